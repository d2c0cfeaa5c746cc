# make demo   a sample case with known truth, registered; nothing else has to be installed first
# make test   the tests of the core and of the Slicer module (installs pytest, torch, slicer-core and PySide6 as well;
#             the module's are skipped, with the reason, where they cannot run)
# make lint   ruff and mypy
# make docs   the documentation as HTML in build/docs; warnings and broken links are errors
# make fuzz   200,000 hostile files for every reader: hours; it goes on where it stopped (Testing/fuzz)
# make fuzz-guided  10,000 more for each, guided by coverage (atheris: Linux, Python 3.11 to 3.13)
# make faults  540 trials of kills, full disks and other bad days, 300 in the Slicer modules (Testing/faults); goes on
# make lock   pins in constraints.txt for what the pinned packages need in turn
# make licences  THIRD_PARTY.md, the licences of all packages
# make test-wheel  wheel and sdist, installed into an empty environment, run the demo
# make bench  OrganPhys and its peers on the cases in CASES, as JSON, one HTML page and a part of RESULTS.md (25 minutes
#             on 2 cores); make bench-full adds sweeps, seeds, scaling, speeds (hours); both go on where stopped.
#             FRESH=1: bench runs again what is there; MINUTES=60: bench-full begins no run later
# make clean  remove the environment and what the demo wrote
#
# Needs Python >= 3.10 and the network on the first call. Another interpreter: make demo PYTHON=/path/to/python3

VENV ?= .venv
BIN := $(VENV)/bin
DEMO ?= organphys-demo
CASES ?= ../shared/cases/dev
BENCH ?= organphys-bench
MINUTES ?=
FRESH ?=
IS_NEW_ENOUGH := import sys; sys.exit(sys.version_info < (3, 10))

# The first of these that runs and is new enough; left empty when there is none.
PYTHON ?= $(shell for p in python3 python3.12 python3.13 python3.11 python3.10 python; do \
	$$p -c '$(IS_NEW_ENOUGH)' >/dev/null 2>&1 && echo $$p && break; done)

.PHONY: demo test test-core test-slicer fuzz fuzz-guided faults lint setup setup-test clean docs bench bench-full lock licences test-wheel

demo: setup
	$(BIN)/organphys demo --out $(DEMO)

test: test-core test-slicer

test-core: setup-test
	$(BIN)/python -m pytest

# A process of its own: the test host changes PySide6 for all code in it.
test-slicer: setup-test
	$(BIN)/python -m pytest -rs Testing/slicer

fuzz: setup-test
	$(BIN)/python Testing/fuzz/campaign.py

fuzz-guided: setup-test
	$(BIN)/python Testing/fuzz/guided.py

faults: setup-test
	$(BIN)/python Testing/faults/campaign.py

lint: setup-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# Methods x cases against known truth; CASES: a folder of case folders. Both go on where they were stopped.
bench: setup-test
	$(BIN)/organphys-bench --cases "$(CASES)" --out "$(BENCH)" --results Testing/benchmarks/RESULTS.md $(if $(FRESH),--fresh)

bench-full: setup-test
	$(BIN)/organphys-bench --cases "$(CASES)" --out "$(BENCH)" --full $(addprefix --minutes ,$(MINUTES)) \
	  --results Testing/benchmarks/RESULTS.md
	$(BIN)/python Testing/benchmarks/scaling.py
	$(BIN)/python Testing/benchmarks/scaling.py --target
	$(BIN)/python Testing/benchmarks/parts_speed.py --keep
	$(BIN)/python Testing/benchmarks/gpu_speed.py

docs: $(VENV)/.installed-docs
	$(BIN)/python -m sphinx -W --keep-going -q Resources/Docs build/docs

lock: $(VENV)/.installed-test $(VENV)/.installed-docs
	$(BIN)/python -m pip install --quiet --disable-pip-version-check uv==0.13.9
	PATH="$(abspath $(BIN)):$$PATH" $(BIN)/python .ci/lock.py

licences: $(VENV)/.installed-test $(VENV)/.installed-docs
	$(BIN)/python .ci/licences.py

test-wheel: setup-test
	.ci/test_wheel "$(abspath $(BIN))/python"

setup: $(VENV)/.installed
setup-test: $(VENV)/.installed-test

$(VENV)/.created:
	@test -n "$(PYTHON)" || { echo "make: no Python >= 3.10 found: install one or give it, make PYTHON=/path/to/python3" >&2; exit 1; }
	@"$(PYTHON)" -c '$(IS_NEW_ENOUGH)' || { echo "make: $(PYTHON) is not a Python >= 3.10: give another, make PYTHON=/path/to/python3" >&2; exit 1; }
	"$(PYTHON)" -m venv $(VENV) || { rm -rf $(VENV); echo "make: no venv module: on Debian or Ubuntu, apt install python3-venv" >&2; exit 1; }
	@touch $@

$(VENV)/.installed: $(VENV)/.created pyproject.toml constraints.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	@touch $@

$(VENV)/.installed-test: $(VENV)/.created pyproject.toml constraints.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[slicer-test]"
	@touch $@ $(VENV)/.installed

$(VENV)/.installed-docs: $(VENV)/.created pyproject.toml constraints.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[docs]"
	@touch $@ $(VENV)/.installed

clean:
	rm -rf $(VENV) $(DEMO)
