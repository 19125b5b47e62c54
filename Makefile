# Every target works on a fresh clone: the first one called creates .venv from the lock file.
PYTHON ?= python3
VENV := .venv
# Our matrices are small: threads of the linear algebra wait for each other longer than they work.
export OPENBLAS_NUM_THREADS ?= 1
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed

.PHONY: help demo test lint bench prove crash lock clean schema

help:
	@echo "make demo   calibrate the emulated rig, then measure its accuracy (about a minute)"
	@echo "make test   lint, type check and test everything"
	@echo "make bench  accuracy, speed and detection of spots, kept in docs/benchmarks (about ten minutes)"
	@echo "make prove  12 000 simulated calibrations against what is stated of them (a few minutes)"
	@echo "make crash  a session of 10 000 captures with random faults; nothing may be lost (a quarter of an hour)"
	@echo "make lint   only the linters and the type checker"
	@echo "make lock   renew requirements.lock from pyproject.toml"

$(INSTALLED): requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed, this is " + sys.version.split()[0])'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

demo: $(INSTALLED)
	$(BIN)/workbench run procedures/calibrate-flat.yaml procedures/accuracy-flat.yaml --rig rigs/thesis-emulated.yaml

prove: $(INSTALLED)
	$(BIN)/python -m tests.proofs

crash: $(INSTALLED)
	$(BIN)/python -m tests.crash.long

lint: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

test: lint
	$(BIN)/python -m pytest -m "not real_time"
	$(BIN)/python -m pytest -n 0 -m real_time

bench: $(INSTALLED)
	$(BIN)/python -m tests.benchmarks

lock:
	uv pip compile pyproject.toml --extra dev --universal --python-version 3.11 --fork-strategy fewest \
		--generate-hashes --no-emit-index-url --no-header --no-annotate --output-file requirements.lock

schema: $(INSTALLED)
	$(BIN)/python -c 'import json; from workbench.model.calibration import Calibration; print(json.dumps(Calibration.model_json_schema(), indent=2))' > docs/calibration.schema.json

clean:
	rm -rf $(VENV) sessions build dist .mypy_cache .pytest_cache .ruff_cache .hypothesis
