"""Schemas of the database, each from the one before; Alembic runs them."""
