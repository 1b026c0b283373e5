"""Run the benchmarks that need no data."""

from benchmarks import cost, fields, phantoms

phantoms.main()
fields.known()
cost.main()
