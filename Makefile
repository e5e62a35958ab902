# Everything a person or CI runs, from a fresh clone with Python >= 3.11 and make. `make help` lists it.

PYTHON ?= python3
BIN := .venv/bin
PYTEST := $(BIN)/python -m pytest
PIP := $(BIN)/python -m pip -qq
CLEAN := $(BIN)/python tools/clean_environment.py
# Exactly the packages that are listed, with the content that is listed (requirements/, made by `make lock`).
LOCKED := $(BIN)/python -m tools.install

# Old pip applies the first to build environments too, new pip wants the second for them.
export PIP_CONSTRAINT := constraints.txt
export PIP_BUILD_CONSTRAINT := $(PIP_CONSTRAINT)
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PIP_ROOT_USER_ACTION := ignore
# Where it is set, each of the hundreds of processes that tests start would compile the sources for itself.
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
.PHONY: help lock setup demo demo-campaigns test test-fresh fuzz mutants test-clients test-faults test-slow test-browser screenshots page-pictures gallery bench bench-full bench-models bench-tuning bench-scale compile-costs blind-check coverage check format format-check lint types imports licences audit docs notebooks links docs-links clean

help: ## list these commands
	@grep -hE '^[a-z-]+:.*## ' Makefile | sed -E 's/^([a-z-]+):.*## (.*)/make \1	\2/' | expand -t 18

setup: .venv/.pyroshock-dev ## everything to develop with, and the commit hooks (CONTRIBUTING.md)
	@$(BIN)/pre-commit install -c .pre-commit-config.yaml >/dev/null && echo "ready: make test"

demo: .venv/.pyroshock-models ## the product from end to end, in a few minutes
	@$(BIN)/pyroshock demo

TESTS ?= tests

# A file's tests share what they set up, hence a file is one worker's. The workers share the cores, hence one thread each:
# sums of several threads differ in their last digit from run to run.
WORKERS ?= 2

# Without the home, the fonts and the variables of whoever runs them: what passes for one person passes for all.
test: .venv/.pyroshock-dev ## the default tests (or TESTS): no slow ones, no benchmarks; WORKERS at a time, in an empty home
	@OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(CLEAN) $(PYTEST) -m "not slow and not bench" -n $(WORKERS) --dist loadfile $(TESTS)

test-fresh: ## `make demo test` as on a new machine: what is committed, cloned into an empty folder, with an environment made from nothing
	@folder=$$(mktemp -d) && trap 'rm -rf "$$folder"' EXIT && git clone -q . "$$folder/pyroshock" && \
	  python=$$($(PYTHON) -c 'import os, sys; print(os.path.realpath(sys.executable))') && \
	  "$$python" tools/clean_environment.py $(MAKE) --no-print-directory -C "$$folder/pyroshock" PYTHON="$$python" demo test TESTS="$(TESTS)"

ROUNDS ?= 5

mutants: .venv/.pyroshock-test ## one change at a time in MODULES, and whether a test notices: hours for all; docs/measurements/mutation.md
	@$(BIN)/python -m tools.mutation $(foreach each,$(MODULES),'$(each)') --jobs $(WORKERS)

test-clients: .venv/.pyroshock-test ## a whole laboratory at once, ROUNDS times on each engine: half an hour
	@PYROSHOCK_ROUNDS=$(ROUNDS) $(PYTEST) tests/clients tests/training/test_shared_registry.py --durations=20

INPUTS ?= 100000

fuzz: .venv/.pyroshock-fuzz ## INPUTS damaged files for every reader, table and way in: an hour on two cores; docs/measurements/fuzzing.md
	@PYTHONPATH=tests $(BIN)/python -m fuzzing --inputs $(INPUTS) --jobs $(WORKERS)

test-faults: .venv/.pyroshock-test ## kills, full disks, crashed servers, damaged files: 200 kills take half an hour on a free machine
	@$(PYTEST) tests/faults --timeout=0

test-slow: .venv/.pyroshock-test ## the slow tests
	@$(PYTEST) -m "slow and not bench"

BROWSER := $(wildcard tests/app/web/test_browser_*.py)

test-browser: .venv/.pyroshock-test ## every page in headless Chromium (apt-get install chromium)
	@$(PYTEST) -m slow $(BROWSER)

screenshots: .venv/.pyroshock-test ## the same, and the pages' pictures in docs/images made anew
	@PYROSHOCK_SCREENSHOTS=docs/images $(PYTEST) -m slow $(filter-out %_pages.py,$(BROWSER))

PICTURES ?= results/pages

page-pictures: .venv/.pyroshock-test ## every page at 1400 and 390 pixels, light and dark, into PICTURES (results/pages)
	@mkdir -p $(PICTURES) && PYROSHOCK_PAGE_PICTURES=$(abspath $(PICTURES)) $(PYTEST) -m slow tests/app/web/test_browser_pages.py -k any_width

demo-campaigns: .venv/.pyroshock-dev ## the shots of the virtual bench that ship for the demo anew into examples/, from their seeds
	@$(BIN)/python -m examples.virtual_campaigns --out examples

gallery: .venv/.pyroshock-test ## the thesis's figures that the software can draw, anew into docs/images/gallery: some minutes
	@$(BIN)/python -m examples.gallery --out docs/images/gallery

bench: .venv/.pyroshock-bench ## everything beside its peers, in a quarter of an hour, into docs/measurements/benchmarks.md
	@$(BIN)/python -m benchmarks

compile-costs: .venv/.pyroshock-models ## what each compiled function costs a new installation, in CPU seconds: three minutes
	@$(BIN)/python -m tools.compile_costs

bench-full: .venv/.pyroshock-bench ## every promise at full size: 180 recordings, a million impacts; two hours
	@$(PYTEST) -m bench --timeout=0 tests

bench-models: .venv/.pyroshock-test ## every model on three virtual campaigns: half an hour
	@$(BIN)/python -m benchmarks.models

bench-tuning: .venv/.pyroshock-test ## settings for 20 spectra of the virtual bench, three ways: an hour
	@$(BIN)/python -m benchmarks.tuning

bench-scale: .venv/.pyroshock-test ## a million impacts on PostgreSQL, questions with their plans, room, ingest: half an hour, 10 GB
	@$(BIN)/python -m benchmarks.scale

CASES ?= 3
SPLIT ?= development
SEED ?=

blind-check: .venv/.pyroshock-test ## diagnoses of CASES (3) campaigns of every tier of SPLIT (development), from SEED (the split's own): an hour on two cores; goes on where it stopped
	@$(BIN)/pyroshock blind-check --cases $(CASES) --split $(SPLIT) $(if $(SEED),--seed $(SEED)) \
	  --folder results/blind-check-$(SPLIT)-$(CASES)$(if $(SEED),-$(SEED))

COUNTED := $(CURDIR)/.cache/coverage/counted

# Some tests alone have no floor, and no page.
coverage: .venv/.pyroshock-dev ## the default tests (or TESTS), statements and branches counted by room; fails below the floor
	@rm -rf $(dir $(COUNTED)) && mkdir -p $(dir $(COUNTED))
	@export COVERAGE_FILE=$(COUNTED); status=0; \
	$(CLEAN) $(BIN)/coverage run -m pytest -m "not slow and not bench" --timeout=600 --hypothesis-profile=ci -n $(WORKERS) --dist loadfile $(TESTS) || status=1; \
	$(BIN)/coverage combine -q && $(BIN)/python -m tools.covered $(if $(filter tests,$(TESTS)),--floor --page) || status=1; exit $$status

CHECKS := format-check lint types imports licences audit docs

# Two of the checks at a time, for the longest ones have one process each; the tests alone, which have time limits.
check: .venv/.pyroshock-dev ## what CI runs: format, lint, types, import rules, licences, audit, documentation, tests
	@$(MAKE) --no-print-directory -j 2 --output-sync $(CHECKS)
	@$(MAKE) --no-print-directory test

format: .venv/.pyroshock-dev ## rewrite the sources to the project's format
	@$(BIN)/ruff check -q --fix-only .
	@$(BIN)/ruff format .

format-check: .venv/.pyroshock-dev
	@$(BIN)/ruff format --check .

lint: .venv/.pyroshock-dev
	@$(BIN)/ruff check .
	@$(BIN)/python -m tools.structure --lint

# What tests import by these names, from their own folder.
SHARED_BY_TESTS := support fuzzing doc_pages

types: .venv/.pyroshock-dev .cache/mypy/pyroshock $(SHARED_BY_TESTS:%=.cache/mypy/%)
	@$(BIN)/mypy

licences: .venv/.pyroshock-dev ## every installed package's licence is one that we may use (tools/licences.toml)
	@$(BIN)/python -m tools.licences

docs: .venv/.pyroshock-dev ## the documentation as a site, docs/_build/html/index.html; a warning is an error; no network
	@$(BIN)/python -m sphinx -W --keep-going -q -E -j auto -d docs/_build/doctrees docs docs/_build/html
	@echo "docs: docs/_build/html/index.html"

notebooks: .venv/.pyroshock-dev ## run the documentation's notebooks (docs/notebooks), each in an empty folder
	@$(BIN)/python -m tools.notebooks $(wildcard docs/notebooks/*.py)

links: .venv/.pyroshock-dev ## every link of the Markdown within the repository leads to a file and its heading
	@$(BIN)/python -m tools.links

docs-links: .venv/.pyroshock-dev ## links of the documentation to other hosts still lead somewhere; needs a network
	@$(BIN)/python -m sphinx -b linkcheck -q -E -d docs/_build/doctrees-links docs docs/_build/links

audit: .venv/.pyroshock-dev ## installed packages with a published vulnerability; says so where nobody can be asked
	@$(BIN)/python -m tools.audit

imports: .venv/.pyroshock-dev
	@$(BIN)/lint-imports --no-cache --no-logo

clean: ## remove the virtual environment, caches and results of builds
	rm -rf .venv .cache .mypy_cache .ruff_cache .pytest_cache .hypothesis build dist docs/_build *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# mypy finds a package by the name of its folder, and the clone's folder may be called anything.
.cache/mypy/pyroshock:
	@mkdir -p $(@D)
	@ln -sfn ../.. $@

$(SHARED_BY_TESTS:%=.cache/mypy/%):
	@mkdir -p $(@D)
	@ln -sfn ../../tests/$(@F) $@

LOCKER := uv==0.13.9

lock: ## requirements/ anew from pyproject.toml and constraints.txt: after a dependency was added or raised, or another LOCKER; needs an index
	@$(PYTHON) -m venv .cache/locker && PIP_CONSTRAINT= .cache/locker/bin/python -m pip -qq install $(LOCKER)
	@$(PYTHON) -m tools.lock .cache/locker/bin/uv $(LOCKER)

.venv/.pyroshock-run: pyproject.toml constraints.txt requirements/run.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  version=$$($(PYTHON) -V 2>/dev/null); \
	  echo "pyroshock needs Python 3.11 or newer; '$(PYTHON)' is $${version:-no Python}: name another, make PYTHON=python3.12"; \
	  exit 1; } >&2
	@echo "Installing pyroshock into .venv; the first time takes a minute or two."
	@$(PYTHON) -m venv .venv
	@$(LOCKED) requirements/run.txt
	@PIP_CONSTRAINT= PIP_BUILD_CONSTRAINT= $(PIP) install --no-deps --no-build-isolation -e .
	@touch $@

# PyTorch's build without GPU libraries where it is to be had; the other one needs more to be imported at all.
.venv/.pyroshock-models: .venv/.pyroshock-run requirements/models.txt
	@echo "Installing the extra for models; the first time takes a minute or two."
	@$(LOCKED) requirements/cpu.txt 2>/dev/null || true
	@$(LOCKED) requirements/models.txt
	@if $(BIN)/python -m pip check | grep -qE '^torch .* requires (nvidia|cuda|triton)'; then $(LOCKED) requirements/cuda.txt; fi
	@touch $@

.venv/.pyroshock-test: .venv/.pyroshock-models requirements/test.txt
	@$(LOCKED) requirements/test.txt
	@touch $@

# What does not go with our packages has an environment of its own: QCoDeS brings notebooks, endaq a package named `tests`.
# A peer that cannot be had is no reason to measure none.
PEERS := qcodes endaq
MISSING := echo "bench: not every peer could be installed; the rows say which are missing" >&2

.venv/.pyroshock-bench: .venv/.pyroshock-test $(PEERS:%=benchmarks/environments/%.txt)
	@$(PIP) install -e '.[bench]' || $(MISSING)
	@for peer in $(PEERS); do \
	  $(PYTHON) -m venv .venv/peers/$$peer && PIP_CONSTRAINT= PIP_BUILD_CONSTRAINT= \
	    .venv/peers/$$peer/bin/python -m pip -qq install -r benchmarks/environments/$$peer.txt || $(MISSING); \
	done
	@touch $@

.venv/.pyroshock-fuzz: .venv/.pyroshock-test requirements/fuzz.txt
	@$(LOCKED) requirements/fuzz.txt
	@touch $@

.venv/.pyroshock-dev: .venv/.pyroshock-test requirements/dev.txt
	@$(LOCKED) requirements/dev.txt
	@touch $@
