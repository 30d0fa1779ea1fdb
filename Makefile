# Each target sets up all it needs: Python 3.10 or newer, make and the package index.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/$(if $(filter Windows_NT,$(OS)),Scripts,bin)

# The C of the project, and of the product: the files that are compiled, but those that include all the others, and the
# adaptor for WebAssembly, whose functions are exported by attributes that clang-tidy does not take for a declaration.
C_FILES    = $(shell git ls-files '*.[ch]')
TIDY_FILES = $(filter-out %_fmu.c %/web_assembly.c,$(wildcard fmu_src/*/*.c))

.DEFAULT_GOAL := help
.PHONY: help run cycle design test build explore check lint format workflow compile-commands dist bench soak hosts figure lock clean

help:   ## list the targets; times: Intel Xeon 2.5 GHz, once .venv is there (1 min, 500 MB)
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/\1|\2/p' $(MAKEFILE_LIST) | awk -F '|' -v width="$${COLUMNS:-80}" '{ \
	    line = sprintf("  make %-18s", $$1); count = split($$2, words, " "); \
	    for (k = 1; k <= count; k++) { \
	        if (length(line) + length(words[k]) >= width) { print line; line = sprintf("%25s", "") } \
	        line = line " " words[k] } \
	    print line }'

run: build   ## build the FMUs, run the published planting cycle and plant a field row (1 min on two processors)
	$(BIN)/python -m scenarios

cycle: build   ## build the FMUs and run the published planting cycle alone (25 s)
	$(BIN)/python -m scenarios.paper_cycle

test: $(VENV)/ready-test build   ## build the FMUs and run every test, on all processors (25 min on two)
	$(BIN)/python -m pytest --numprocesses auto --dist loadfile --no-loadscope-reorder

check: lint $(VENV)/ready-test build   ## lint, and the tests of the rooms that differ from main: before a commit
	$(BIN)/python -m tests.check

# The compiler that checks the types in the explorer's JavaScript is on no package index but npm's.
TSC = npm exec --yes --package=typescript@5.9.3 -- tsc

lint: $(VENV)/ready-lint $(VENV)/tidy   ## rules, format and types of Python and of the explorer; rules and format of C
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/biome check --error-on-warnings fmu_src/explorer
	@if command -v npm >/dev/null; then echo '$(TSC)'; $(TSC) --project fmu_src/explorer; \
	    else echo "npm is not here: the types of the explorer's JavaScript are not checked"; fi
	$(BIN)/clang-format --dry-run --Werror $(C_FILES)

# The slowest of them, so only where C, its rules or the program has changed since it was content.
$(VENV)/tidy: $(C_FILES) .clang-tidy $(VENV)/ready-lint | compile-commands
	printf '%s\n' $(TIDY_FILES) | xargs -P 4 -n 3 $(BIN)/clang-tidy --quiet -p .
	@touch $@

format: $(VENV)/ready-lint   ## format Python, the explorer and C, and mend what ruff and biome can mend
	$(BIN)/ruff check --fix
	$(BIN)/ruff format
	$(BIN)/biome check --write fmu_src/explorer
	$(BIN)/clang-format -i $(C_FILES)

compile-commands: $(VENV)/ready   ## write compile_commands.json, by which an editor follows the C
	@$(BIN)/python -m fmu_src.exporter.compile_commands

workflow:   ## check .github/workflows; needs Go
	go run github.com/rhysd/actionlint/cmd/actionlint@v1.7.12

build: $(VENV)/ready   ## build the FMUs into build/ (10 s)
	$(BIN)/linkage-fmu build
	$(BIN)/python -m scenarios.field_row.partners.build
	$(BIN)/python -m scenarios.field_row.ssp

explore: build   ## build the FMUs and open the linkage in a browser, to change it and see what becomes of it
	$(BIN)/linkage-fmu explore

design: $(VENV)/ready-test build   ## find the design that sweeps the least of the ridge and asks no more of anything else (2 min)
	$(BIN)/python -m scenarios.design practical

dist: $(VENV)/ready-test   ## make the wheel and the FMUs for every platform in build/dist/, with checksums (40 s; minutes the first time)
	rm -rf build/dist
	$(BIN)/linkage-fmu build --platform all --output build/dist
	$(BIN)/linkage-fmu validate build/dist/fmi2/TransplanterLinkage.fmu build/dist/fmi3/TransplanterLinkage.fmu
	$(BIN)/python -m fmu_src.exporter.dist build/dist

bench: $(VENV)/ready-bench build   ## measure speed against error beside other packages, the cost of a step, and the hard cases (tens of minutes)
	$(BIN)/python -m scenarios.speed_vs_error

soak: $(VENV)/ready-test build   ## run the long tests: millions of random calls under sanitizers, 200 hours of planting, 10,000 ugly step histories of each of 11 kinds, 900 processes with PythonFMU in them (40 min)
	$(BIN)/python -m tests.soak.hostile
	$(BIN)/python -m tests.soak.histories
	$(BIN)/python -m tests.soak.heap_at_exit

hosts: $(VENV)/ready-test   ## run the FMUs in hosts and checkers that others wrote, and on other platforms; HOST=Ecos: that one alone (10 min; 10 more the first time; says what it fetches)
	@$(BIN)/python -m tests.hosts $(foreach name,$(HOST),--host '$(name)')

# The environment grows with what is asked for. First what runs: locked packages with hashes, each lock file with all
# that its packages need, but for cmake, which fmpy wants for foreign sources alone; the compiler for this system;
# then this project in place, anew where pyproject.toml says something else. Python compiles what it imports, when it
# does: most modules never are.
INSTALL = $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-compile

$(VENV)/ready: $(VENV)/packages pyproject.toml hatch_build.py
	$(INSTALL) --no-build-isolation --editable .
	@touch $@

$(VENV)/packages: requirements-run.lock requirements-compiler.lock
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10) and "Python 3.10 or newer is needed; set PYTHON=")'
	$(PYTHON) -m venv --clear $(VENV)
	$(INSTALL) --require-hashes --requirement requirements-compiler.lock & \
	    $(INSTALL) --require-hashes --requirement requirements-run.lock && wait $$!
	$(BIN)/python -m fmu_src.exporter.lean_compiler
	@touch $@

# What the tests need besides, and the compiler for every platform.
$(VENV)/ready-test: requirements.lock requirements-compiler.lock $(VENV)/packages | $(VENV)/ready
	$(INSTALL) --force-reinstall --require-hashes --requirement requirements-compiler.lock
	$(INSTALL) --require-hashes --requirement requirements.lock
	@touch $@

$(VENV)/ready-lint: requirements-lint.lock $(VENV)/packages | $(VENV)/ready
	$(INSTALL) --require-hashes --requirement requirements-lint.lock
	@touch $@

figure: build   ## draw the documentation's figure of error over step anew
	$(BIN)/python -m scenarios.speed_vs_error --figure fmu_src/documentation/speed_vs_error.svg

# The packages that `make bench` compares with. Without them it runs all the same and names them as missing.
$(VENV)/ready-bench: requirements-bench.lock $(VENV)/packages | $(VENV)/ready-test
	$(INSTALL) --require-hashes --only-binary :all: \
	    --requirement requirements-bench.lock && touch $@ || echo "make bench: other packages could not be installed"

COMPILE := pip compile --quiet --universal --python-version 3.10 --generate-hashes --no-emit-index-url --no-emit-find-links \
    --custom-compile-command 'make lock'

lock:   ## resolve the dependencies anew into the lock files, which agree with one another
	$(PYTHON) -m venv $(VENV)-lock
	$(VENV)-lock/bin/python -m pip install --quiet uv
	$(VENV)-lock/bin/uv $(COMPILE) --upgrade --extra build --group dev --output-file requirements.lock pyproject.toml
	$(VENV)-lock/bin/uv $(COMPILE) --upgrade --extra build --group run --no-emit-package cmake \
	    --no-emit-package ziglang --constraint requirements.lock --output-file requirements-run.lock pyproject.toml
	$(VENV)-lock/bin/uv $(COMPILE) --upgrade --group compiler --constraint requirements.lock \
	    --output-file requirements-compiler.lock
	$(VENV)-lock/bin/uv $(COMPILE) --upgrade --group lint --constraint requirements.lock --output-file requirements-lint.lock
	$(VENV)-lock/bin/uv $(COMPILE) --upgrade --group bench --constraint requirements.lock --output-file requirements-bench.lock
	rm -rf $(VENV)-lock

clean:   ## delete what was produced, and the environment
	git clean -dfxq build $(VENV)
