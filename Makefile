# Everything is set up here, in .venv: all you bring is make and Python 3.11 or newer.
# 3.13 is asked after 3.12 and 3.11 because cmlibs.zinc, which checks our EX files, lacks wheels for it.
PYTHON ?= python3.12 python3.11 python3.13 python3

VENV  := .venv
BIN   := $(VENV)/bin

# Two stages: what the app needs, and on top of it what tests and development need.
READY_APP := $(VENV)/.ready-app
READY     := $(VENV)/.ready

PIP     := $(BIN)/python -m pip install --quiet --disable-pip-version-check
COMPILE := $(BIN)/uv pip compile pyproject.toml --quiet
LOCK    := UV_CUSTOM_COMPILE_COMMAND="make lock" $(COMPILE) --group build \
    --universal --python-version 3.11 --fork-strategy fewest --generate-hashes

.DEFAULT_GOAL := help
# The same text everywhere, whatever the locale.
export PYTHONUTF8 := 1
# Python keeps what it compiles, also where the environment asks it not to.
export PYTHONDONTWRITEBYTECODE :=
.PHONY: help app demo test test-fast test-oldest test-latest check docs bench format lock binder clean

help: ## list these commands
	@sed -n 's/^\([a-z -]*\):.*## /\1\t/p' Makefile | expand -t 12

app: $(READY_APP) ## open the dashboard in the browser, with a sample heart loaded
	$(BIN)/heartgen dashboard $(if $(PORT),--port $(PORT))

demo: $(READY_APP) ## mesh a sample heart and look at the result in out/demo
	$(BIN)/heartgen demo -o out/demo

# A process of tests that dies is told with its test and ends the run: xdist would wait for ever.
PYTEST := $(BIN)/pytest -n 2 --dist loadscope --max-worker-restart=0

test: $(READY) ## run all tests, on two processes
	$(PYTEST) --durations=10

test-fast: $(READY) ## run the tests that are not marked slow
	$(PYTEST) -m "not slow" tests

test-oldest test-latest: $(READY) ## run the tests that are not slow with the oldest, or latest, dependencies
	$(BIN)/uv venv --quiet --clear build/$@
	$(BIN)/uv pip install --quiet --python build/$@ --resolution $(if $(findstring oldest,$@),lowest-direct,highest) \
	    --editable ".[apps,cohort,dev,dicom,plot]"
	build/$@/bin/python -m pytest -m "not slow" tests

check: $(READY) ## lint, format, types, spelling, layers
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy --strict heartgen
	$(BIN)/codespell
	$(BIN)/lint-imports --no-logo

docs: $(READY) ## build the documentation in docs/_build/html, with every notebook run
	$(BIN)/sphinx-build -W --keep-going -q docs docs/_build/html

bench: $(READY) ## measure accuracy, quality and time (see benchmarks/README.md)
	$(BIN)/python -m benchmarks

format: $(READY) ## put the code in its agreed form
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

lock: $(READY) ## bring both locks up to date with pyproject.toml
	$(LOCK) --extra apps --extra cohort --extra course --extra dicom --extra docs --extra plot \
	    --extra service --extra dev \
	    --output-file requirements.lock
	$(LOCK) --extra apps --extra dicom --constraints requirements.lock --no-annotate \
	    --output-file requirements-app.lock

binder: $(READY) ## bring binder/requirements.txt up to date with requirements.lock
	printf '%s\n' '# Made from pyproject.toml and requirements.lock by: make binder' > binder/requirements.txt
	UV_CUSTOM_COMPILE_COMMAND="make binder" $(COMPILE) \
	    --python-version 3.11 --python-platform linux --extra apps --extra course --extra dicom \
	    --constraints requirements.lock --no-annotate --no-header >> binder/requirements.txt

clean: ## remove the environment and everything that was made
	rm -rf $(VENV) build dist docs/_build docs/api docs/course out .coverage .hypothesis .import_linter_cache .mypy_cache \
	    .pytest_cache .ruff_cache
	find heartgen tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +

$(READY_APP): requirements-app.lock
	@[ -x $(BIN)/pip ] || { \
	    for python in $(PYTHON); do \
	        if $$python -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 11))' \
	            >/dev/null 2>&1; then \
	            echo "Setting up $(VENV) with $$($$python --version): this takes a few minutes, once."; \
	            exec $$python -m venv --clear $(VENV); \
	        fi; \
	    done; \
	    echo "heartgen needs Python 3.11 or newer with its venv module, and found none among:" \
	        "$(PYTHON). Install one (Debian, Ubuntu: apt install python3-venv)" \
	        "or name yours: make test PYTHON=/path/to/python3" >&2; \
	    exit 1; \
	}
	@# Python compiles what is imported; to have pip compile everything takes time and 150 MB more.
	@$(PIP) --no-compile --require-hashes -r requirements-app.lock
	@$(PIP) --no-deps --no-build-isolation --editable .
	@# The first fit compiles the kernels; no user and no test should have to wait for it.
	@$(BIN)/python -c "import heartgen; from heartgen import samples; \
	    heartgen.personalize(samples.biv(2.0).mask)"
	@touch $@

$(READY): requirements.lock $(READY_APP)
	@echo "Adding to $(VENV) what tests and development need: this takes a few minutes, once."
	@$(PIP) --require-hashes -r requirements.lock
	@touch $@
