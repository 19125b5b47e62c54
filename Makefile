# Every target works on a fresh clone: the first one called creates .venv from the lock file.
PYTHON ?= python3
# Each interpreter has its own environment: `make test PYTHON=python3.13` uses .venv-python3.13.
VENV := .venv$(if $(filter-out python3,$(PYTHON)),-$(notdir $(PYTHON)))
# Our matrices are small: threads of the linear algebra wait for each other longer than they work.
export OPENBLAS_NUM_THREADS ?= 1
# Tests start hundreds of processes, which share the compiled modules.
export PYTHONDONTWRITEBYTECODE :=
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
# The dependencies of the workbench alone, without those of its developers.
RUNNABLE := $(VENV)/.runnable

.PHONY: help demo test thorough quick wheel lint bench prove mutants crash fuzz lock clean schema pictures tables docs certificate

help:
	@echo "make demo   calibrate the emulated rig, then measure its accuracy (about a minute)"
	@echo "make test   lint, type check and test everything; PYTHON=python3.13 with another interpreter"
	@echo "make thorough  further cases of the same tests, and long ones (ten minutes)"
	@echo "make quick  lint, type check and the fast unit tests (a minute and a half)"
	@echo "make bench  accuracy, speed and detection of spots, kept in docs/benchmarks (about ten minutes)"
	@echo "make prove  stated uncertainties compared with simulated calibrations, shapes and trials (an hour)"
	@echo "make mutants  200 wrong versions of the core; the tests must find nine of ten (an hour or two)"
	@echo "make crash  a session of 10 000 captures with random faults; none may be lost (a quarter of an hour)"
	@echo "make fuzz   100 000 mutated inputs at every door, and 500 commands (ten minutes at most)"
	@echo "make wheel  build the wheel, install it with the run-time dependencies only, run a session (two minutes)"
	@echo "make lint   only the linters and the type checker"
	@echo "make pictures  the pictures in docs/images, of new runs of the demo (four minutes)"
	@echo "make tables  the tables of the documentation, from the outputs in docs/benchmarks (ten seconds)"
	@echo "make docs   the documentation site in build/website/site, with the figures of the notebooks (two minutes)"
	@echo "make certificate  docs/certificate-demo.pdf and its picture, of a new run of the demo (a minute)"
	@echo "make lock   update requirements.lock and requirements-run.lock from pyproject.toml"

$(BIN)/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed, this is " + sys.version.split()[0])'
	$(PYTHON) -m venv $(VENV)

$(RUNNABLE): requirements-run.lock pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements-run.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

$(INSTALLED): requirements.lock pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@touch $@ $(RUNNABLE)

demo: $(RUNNABLE)
	$(BIN)/workbench run procedures/calibrate-flat.yaml procedures/accuracy-flat.yaml --rig rigs/thesis-emulated.yaml

prove: $(INSTALLED)
	$(BIN)/python -m tests.proofs
	$(BIN)/python -m tests.proofs.situations
	$(BIN)/python -m tests.proofs.shapes
	$(BIN)/python -m tests.proofs.trials
	$(BIN)/python -m tests.proofs.worlds
	$(BIN)/python -m tests.proofs.scanning
	$(BIN)/python -m tests.proofs.layouts

mutants: $(INSTALLED)
	$(BIN)/python -m tests.mutants

crash: $(INSTALLED)
	$(BIN)/python -m tests.crash.long
	$(BIN)/python -m tests.crash.trials
	$(BIN)/python -m tests.crash.campaign_long

fuzz: $(INSTALLED)
	$(BIN)/python -m tests.fuzz

lint: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/codespell
	$(BIN)/python -m tests.prose

# The type checker takes minutes of one core: it runs beside the tests, which have priority.
test: $(INSTALLED)
	@nice -n 10 $(MAKE) lint & lint=$$!; \
	$(BIN)/python -m pytest -m "not real_time and not wheel and not thorough"; tests=$$?; \
	wait $$lint && exit $$tests
	$(BIN)/python -m pytest -n 0 -m "real_time and not thorough"

thorough: $(INSTALLED)
	$(BIN)/python -m pytest -m thorough

quick: lint
	$(BIN)/python -m pytest -m "not slow and not real_time and not thorough" tests/unit

wheel: $(INSTALLED)
	$(BIN)/python -m pytest -n 0 -m wheel

bench: $(INSTALLED)
	$(BIN)/python -m tests.benchmarks

# The second file holds versions of the first only.
LOCK := uv pip compile pyproject.toml --universal --python-version 3.11 --fork-strategy fewest \
	--generate-hashes --no-emit-index-url --no-header --no-annotate
lock:
	$(LOCK) --extra dev --output-file requirements.lock
	$(LOCK) --extra build --constraint requirements.lock --output-file requirements-run.lock

pictures: $(INSTALLED)
	$(BIN)/python -m tests.viewer.pictures
	$(BIN)/python -m tests.viewer.certificate docs

tables: $(INSTALLED)
	$(BIN)/python -m tests.tables

docs: $(INSTALLED)
	$(BIN)/python -m tests.website

certificate: $(INSTALLED)
	$(BIN)/python -m tests.viewer.certificate docs

schema: $(INSTALLED)
	$(BIN)/python -c 'import json; from workbench.model.calibration import Calibration; print(json.dumps(Calibration.model_json_schema(), indent=2))' > docs/calibration.schema.json
	$(BIN)/python -c 'import json; from workbench.campaign.campaign_file import CampaignFile; print(json.dumps(CampaignFile.model_json_schema(), indent=2))' > docs/campaign.schema.json

clean:
	rm -rf .venv .venv-* sessions build dist .mypy_cache .pytest_cache .ruff_cache .hypothesis
