# SPDX-License-Identifier: GPL-3.0-or-later
# `make` alone lists the targets. The first one that needs Python sets up .venv by itself.

SHELL := /bin/bash
VENV := .venv
READY := $(VENV)/.ready
BIN := $(VENV)/bin

.DEFAULT_GOAL := help
.PHONY: help venv demo test test-all truths golden fit stress lint format bench bench-paper package blender blender-venvs pictures compositor clean distclean profile

help:  ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 20

# One stamp: it is older than what it depends on only when something must be installed again.
$(READY): requirements.txt requirements-dev.txt scripts/setup.sh
	@bash scripts/setup.sh $(VENV)
	@touch $@

venv: $(READY)  ## set up .venv: Python 3.11, Blender as a module, the tools

demo: $(READY)  ## build the demo .blend and render it headless through the add-on
	$(BIN)/python demo/build.py
	$(BIN)/python demo/render.py

lint: $(READY)  ## ruff, ruff format and mypy --strict on the core
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/python -m mypy --strict adaptive_drt

test: lint  ## lint, and every test that is not slow
	$(BIN)/python -m pytest tests -m "not slow" -n auto --dist worksteal

test-all: lint  ## lint, and every test; what the oracle says is computed anew
	ADAPTIVE_DRT_TRUTHS=check $(BIN)/python -m pytest tests

golden: $(READY)  ## write the golden pictures again, where they are meant to change: CONTRIBUTING.md
	OPENBLAS_NUM_THREADS=1 $(BIN)/python scripts/write_golden.py

truths: $(READY)  ## compute what the oracle says in the tests, and keep it: docs/testing.md
	ADAPTIVE_DRT_TRUTHS=keep $(BIN)/python -m pytest -m "not slow" $$(grep -rl "oracle.kept" tests --include='test_*.py' | grep -v test_kept)

fit: $(READY)  ## fit the error model, write its coefficients and docs/error-model.md (five minutes on one core)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python benchmarks/fit_error_model.py $(FIT)

stress: $(READY)  ## the long stress test: kernels, hostile and changed scenes, masks; docs/stability.md
	$(BIN)/python benchmarks/stress.py $(STRESS)

format: $(READY)  ## format the code, fix what ruff can fix
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(READY)  ## time against error beside Cycles and Mitsuba, write docs/benchmark.md (three quarters of an hour)
	@bash benchmarks/bench_setup.sh $(abspath $(VENV))
	$(BIN)/python benchmarks/bench.py $(BENCH)

profile: $(READY)  ## seconds by stage, the cost of derivatives, a profile: docs/profile.md
	$(BIN)/python benchmarks/stages.py --page docs/profile.md $(PROFILE)

bench-paper: $(READY)  ## run the paper's table, write docs/paper-table.md
	$(BIN)/python benchmarks/paper.py

package: $(READY)  ## build the extension's zips in dist/, with embreex's wheels inside
	$(BIN)/python scripts/package.py

blender:  ## make Blender 5.2 and 4.3 as programs, outside the repository; needs root, debootstrap
	bash scripts/blender.sh build 5.2
	bash scripts/blender.sh build 4.3

blender-venvs: $(READY)  ## make Blender 4.2 and 5.0 as modules, outside the repository
	bash scripts/venvs.sh

pictures: $(READY)  ## take the screenshots in docs/pictures again, in Blender 5.2's own window
	ADAPTIVE_DRT_PICTURES=docs/pictures $(BIN)/python -m pytest -k 5.2 \
		tests/gui/test_window.py tests/gui/test_first_click.py tests/gui/test_first_mask.py

compositor: $(READY)  ## build and render the example of the mask in the compositor
	$(BIN)/python demo/compositor.py

clean:  ## remove caches
	rm -rf .pytest_cache tests/.pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -not -path './$(VENV)/*' -prune -exec rm -rf {} +

distclean: clean  ## remove caches and .venv
	rm -rf $(VENV)
