# `make book` and `make test` are all that a reader needs; `make help` lists the rest.

PYTHON ?= python3
BIN := .venv/bin

# One thread for each BLAS: the chapters share the cores among themselves (THESIS_JOBS). Their processes
# take one kernel as well, so that sums are taken in one order on every machine (thesislib.arithmetic).
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help book test test-fast environment chapters check site lint bench bench-peers bench-growth bench-table-4-2 study-table-4-2 lock clean

help:  ## List these targets
	@sed -n 's/^\([a-z0-9-]*\):.*  ## \(.*\)/make \1|\2/p' $(firstword $(MAKEFILE_LIST)) | \
	while IFS='|' read -r target purpose; do printf '%-18s %s\n' "$$target" "$$purpose"; done

book: environment chapters check site  ## Install, execute what is not current, check, build _build/html/index.html

test: environment lint chapters check site  ## All of `make book`, with lint before and the tests after it
	@$(BIN)/python -m pytest --cov --cov-report=term

test-fast: environment lint  ## Lint and the tests that need no executed chapter
	@$(BIN)/python -m pytest -m "not book"

environment:  ## Make .venv from environment-pip.txt, or find that it is current
	@$(PYTHON) scripts/bootstrap.py

chapters: environment  ## Execute the chapters whose last run is not current
	@$(BIN)/thesis run --all

check: environment  ## Compare the last runs with the stored values in data/expected
	@$(BIN)/thesis check

site: environment  ## Build the pages from the last runs
	@$(BIN)/thesis site

lint: environment  ## Style, types, which room imports which, and whether every test can be collected
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports
	@found=$$($(BIN)/python -m pytest --collect-only -qq) || { echo "$$found"; exit 1; }

bench: environment  ## Measure published problems, a lap, ride heights, sums of squares; `make bench KEEP=--keep` files the results
	@$(BIN)/python benchmarks/published.py $(KEEP)
	@$(BIN)/python benchmarks/evaluation.py $(KEEP)
	@$(BIN)/python benchmarks/lap.py $(KEEP)
	@$(BIN)/python benchmarks/suspension.py $(KEEP)
	@$(BIN)/python benchmarks/stability.py $(KEEP)

bench-peers: environment  ## Measure other packages on the published problems, in environments of their own (20 minutes)
	@$(BIN)/python benchmarks/published.py --peers $(KEEP)

bench-growth: environment  ## Measure how an iteration of the lap grows with the number of points
	@$(BIN)/python benchmarks/growth.py $(KEEP)

bench-table-4-2: environment  ## Measure Table 4.2 against the same programme in casadi.Opti, and warm starts (40 minutes)
	@$(BIN)/python benchmarks/table_4_2.py $(KEEP)
	@$(BIN)/python benchmarks/warm_starts.py $(KEEP)

study-table-4-2: environment  ## Solve Table 4.2 from two more starts a row and keep the result in data/studies (an hour)
	@$(BIN)/python scripts/table_4_2_starts.py

# Pins that are in the lock already are kept; `make lock UPGRADE=--upgrade` takes the newest.
lock: environment  ## Resolve environment.in into environment-pip.txt
	@$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
		--no-emit-find-links --no-emit-index-url --custom-compile-command "make lock" $(UPGRADE) \
		environment.in --output-file environment-pip.txt

clean:  ## Remove all results (_build, stored solutions included) and the tools' caches; keep .venv
	rm -rf _build .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
