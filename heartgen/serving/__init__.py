"""What serves the apps: Jupyter's server on one port, guarded and limited; and `heartgen view`."""
