# Each target sets up all it needs: Python 3.10 or newer, make and the package index.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/$(if $(filter Windows_NT,$(OS)),Scripts,bin)

.DEFAULT_GOAL := help
.PHONY: help run cycle test build dist bench soak hosts figure lock clean

help:   ## list the targets
	@sed -n 's/^\([a-z]*\):.*## \(.*\)/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 16

run: cycle   ## build the FMUs, run the published planting cycle and plant a field row
	$(BIN)/python -m scenarios.field_row

cycle: build   ## build the FMUs and run the published planting cycle alone
	$(BIN)/python -m scenarios.paper_cycle

test: build   ## build the FMUs and run every test
	$(BIN)/python -m pytest

build: $(VENV)/ready   ## build the FMUs into build/
	$(BIN)/linkage-fmu build
	$(BIN)/python -m scenarios.partners.build
	$(BIN)/python -m scenarios.ssp

dist: $(VENV)/ready   ## make the wheel and the FMUs for every platform in build/dist/, with checksums
	rm -rf build/dist
	$(BIN)/linkage-fmu build --platform all --output build/dist
	$(BIN)/linkage-fmu validate build/dist/fmi2/TransplanterLinkage.fmu build/dist/fmi3/TransplanterLinkage.fmu
	$(BIN)/python -m fmu_src.exporter.dist build/dist

bench: build $(VENV)/ready-bench   ## measure what a step costs, speed against error beside other packages, and the hard cases
	$(BIN)/python -m tests.hosts.step_cost
	$(BIN)/python -m tests.solving
	$(BIN)/python -m scenarios.speed_vs_error
	$(BIN)/python -m tests.hard_cases

soak: build   ## run the long tests: millions of random calls under sanitizers, 200 hours of planting
	$(BIN)/python -m tests.hosts.hostile

hosts: build   ## run the FMUs in hosts and checkers that others wrote, and on other platforms
	$(BIN)/python -m tests.hosts.table
	$(BIN)/python -m tests.hosts.foreign_platforms

# The environment: locked packages with hashes, then this project in place.
$(VENV)/ready: requirements.lock pyproject.toml hatch_build.py
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10) and "Python 3.10 or newer is needed; set PYTHON=")'
	$(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

figure: build   ## draw the README's figure of error over step anew
	$(BIN)/python -m scenarios.speed_vs_error --figure scenarios/speed_vs_error.svg

# The packages that `make bench` compares with. Without them it runs all the same and names them as missing.
$(VENV)/ready-bench: requirements-bench.lock $(VENV)/ready
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --only-binary :all: \
	    --requirement requirements-bench.lock && touch $@ || echo "make bench: other packages could not be installed"

COMPILE := pip compile --quiet --universal --python-version 3.10 --generate-hashes --no-emit-index-url --no-emit-find-links \
    --custom-compile-command 'make lock'

lock:   ## resolve the dependencies anew into requirements.lock and requirements-bench.lock
	$(PYTHON) -m venv $(VENV)-lock
	$(VENV)-lock/bin/python -m pip install --quiet uv
	$(VENV)-lock/bin/uv $(COMPILE) --upgrade --extra build --group dev --output-file requirements.lock pyproject.toml
	$(VENV)-lock/bin/uv $(COMPILE) --upgrade --group bench --constraint requirements.lock --output-file requirements-bench.lock
	rm -rf $(VENV)-lock

clean:   ## delete what was produced, and the environment
	git clean -dfxq build $(VENV)
