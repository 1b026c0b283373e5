"""Run the benchmarks that need no data."""

from benchmarks import cost, phantoms

phantoms.main()
cost.main()
