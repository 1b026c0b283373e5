"""The service: submit from anywhere, keep everything, find it again.

`heartgen serve` answers requests (`heartgen.service.app`), keeps what it knows in a database
(`tables`, `jobs`, `library`) and files in a folder (`artifacts`), and has the work done by Dask
(`dispatcher`, `work`) in processes of their own.
"""
