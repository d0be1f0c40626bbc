# Each target works on a fresh clone and sets up its requirements.
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

PYTHON ?= $(or $(shell command -v python3.11),python3)
VENV   := .venv
BIN    := $(VENV)/bin
CORE   := $(VENV)/.core-complete
STAMP  := $(VENV)/.complete
JOBS   ?= 3
MINUTES ?= 10
EXTRAS := dev,docs,train,viewer,game,ray,parquet,science,digital-curling,app,offline
COMMA  := ,
TORCH  := $(shell sed -n 's/^\(torch==[0-9.]*\).*/\1/p' constraints.txt)

# One process, one core: the tests run side by side, and numeric libraries that each start a
# thread per core only get in each other's way. The tests of a file share its films: one process
# runs them all, so that no film is drawn and tracked twice.
SINGLE := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 NUMBA_NUM_THREADS=1

# Compiled modules are kept, whatever the machine's setting: hundreds of processes read them.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help setup demo test browser lint format types arch bench figures figures-page docs docs-serve \
	docs-test notebooks schemas soak fuzz faults mutants release-check sbom lock clean

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-13s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: $(STAMP)  ## the development environment in .venv (3 GB)

# Dependencies of the package alone, checked against their hashes.
$(CORE): pyproject.toml constraints-core.txt
	@echo "Setting up $(VENV): the package and its dependencies, 0.9 GB ..."
	$(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --require-hashes --no-deps --requirement constraints-core.txt
	@$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

# Everything else: PyTorch from a folder of wheels that pip knows on this machine (PIP_FIND_LINKS), if
# there is one; what constraints.txt lists; and what PyTorch's build for GPUs asks for.
$(STAMP): $(CORE) constraints.txt
	@echo "Setting up $(VENV): tests, training, documents ..."
	@$(BIN)/python -m pip install --quiet --no-index --no-deps $(TORCH) 2>/dev/null || true
	@$(BIN)/python -m pip install --quiet --require-hashes --no-deps --requirement constraints.txt
	@$(BIN)/python -m pip install --quiet --no-build-isolation \
		--editable '.[$(EXTRAS)]'
	@touch $@

demo: $(CORE)  ## film, track, estimate, plan and throw on rendered films, into runs/demo; DEMO='--throws 12'
	$(BIN)/curling demo -o runs/demo $(DEMO)

test: setup browser docs  ## all tests, with the browser and the site that some need
	$(SINGLE) $(BIN)/pytest -n $(JOBS) --dist loadfile --no-loadscope-reorder -q

browser:  # Chromium, if this machine has none and lets us install it
	@bash scripts/install_browser.sh

lint: setup  ## wording, style, types and import rules
	$(BIN)/python scripts/language.py
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	@$(MAKE) --no-print-directory types arch

format: setup  ## format the code
	$(BIN)/ruff check --fix
	$(BIN)/ruff format
	$(BIN)/jupyter nbconvert --log-level=WARN --clear-output docs/notebooks/*.ipynb \
		--ClearMetadataPreprocessor.enabled=True --ClearMetadataPreprocessor.clear_notebook_metadata=False

types: setup  ## strict for curling_env, standard for the rest
	$(BIN)/basedpyright --warnings

arch: setup  ## import rules
	$(BIN)/lint-imports --no-cache

bench: setup  ## speed, one line per measure
	$(SINGLE) $(BIN)/curling bench

figures: setup  ## measure the quick figures of figures.json again (GROUP=physics for one group) and compare
	$(BIN)/python scripts/figures.py check $(GROUP)

figures-%: setup  # one group: make figures-films, make figures-inference
	$(BIN)/python scripts/figures.py check $*

figures-page: setup  ## docs/results.md, from figures.json
	$(BIN)/python scripts/figures.py page

docs: setup  ## the site, into site/; warnings and broken links are errors
	@cd scripts && $(SINGLE) ../$(BIN)/python -m website ../site

docs-serve: docs  ## the site in the browser, at http://127.0.0.1:8000/
	@$(BIN)/python -m http.server 8000 --bind 127.0.0.1 --directory site

docs-test: docs  ## run every example of every page, and check the site in a browser
	CURLING_EXAMPLES=all $(SINGLE) $(BIN)/pytest -n $(JOBS) -q tests/test_examples.py tests/test_site.py

notebooks: setup  ## every notebook executed, as a page with its outputs, into runs/notebooks
	$(SINGLE) $(BIN)/jupyter nbconvert --to html --execute --output-dir runs/notebooks docs/notebooks/*.ipynb

schemas: setup  ## the JSON Schemas of every file format, into docs/schemas
	$(BIN)/python scripts/schemas.py

soak: setup  ## the property tests with ten seeds of new examples, and ten thousand random ends
	for seed in 1 2 3 4 5 6 7 8 9 10; do \
		$(SINGLE) CURLING_HYPOTHESIS=soak \
		$(BIN)/pytest -n $(JOBS) -q -m hypothesis --hypothesis-seed=$$seed || exit 1; \
		$(SINGLE) CURLING_SOAK_ENDS=1000 CURLING_SOAK_SEED=$$seed \
		$(BIN)/pytest -n 0 -q tests/curling_env/game/test_soak.py || exit 1; done

fuzz: setup  ## ten minutes (MINUTES=60) of hostile inputs to every command; FUZZ='--inputs 10000 --seed 0'
	cd scripts && $(SINGLE) ../$(BIN)/python -m fuzz $(or $(FUZZ),--minutes $(MINUTES))

faults: setup  ## kills at any moment, full disks and odd environments, for every command
	cd scripts && $(SINGLE) ../$(BIN)/python -m fuzz --inputs 300 --keep ../runs/faults \
		--kinds killed 'full disk' surroundings variables

mutants: setup  ## 300 small faults in the code, and the share that the tests detect
	@$(PYTHON) -m venv runs/tools
	@runs/tools/bin/python -m pip install --quiet cosmic-ray
	@runs/tools/bin/python -m pip install --quiet --no-deps --upgrade --target runs/tools/plugins \
		pytest-testmon pytest-timeout
	@runs/tools/bin/python scripts/mutation.py --workers $(JOBS) $(MUTANTS)

release-check:  ## wheel and sdist in clean environments of every Python, extras one by one
	$(PYTHON) -m venv runs/tools
	runs/tools/bin/python -m pip install --quiet uv
	cd scripts && ../runs/tools/bin/python -m release.check $(CHECKS)

sbom:  ## bill of materials (CycloneDX) of an installation, and the pages of licences and sizes
	$(PYTHON) -m venv runs/tools
	runs/tools/bin/python -m pip install --quiet cyclonedx-bom 'cyclonedx-python-lib[json-validation]' packaging uv
	cd scripts && ../runs/tools/bin/python -m release.bill

LOCK := runs/lock/bin/uv pip compile pyproject.toml - --quiet --universal --python-version 3.11 \
	--generate-hashes --no-annotate --custom-compile-command 'make lock'

# uv resolves for all systems and Pythons at once, and keeps versions that fit. Editable installations
# build with setuptools, which no dependency names. What only PyTorch's build for NVIDIA's GPUs needs
# is gigabytes, and that build fixes its versions itself.
lock:  ## constraints.txt and constraints-core.txt, with hashes (UPGRADE=--upgrade: the newest versions)
	$(PYTHON) -m venv runs/lock
	runs/lock/bin/python -m pip install --quiet uv
	echo 'setuptools>=77' | $(LOCK) --output-file constraints.txt $(UPGRADE) \
		$(foreach extra,$(subst $(COMMA), ,$(EXTRAS)),--extra $(extra))
	awk 'BEGIN { kept = 1 } /^[a-z]/ { kept = !/^(nvidia-|cuda-|triton==)/ } kept' constraints.txt > runs/lock/new
	mv runs/lock/new constraints.txt
	echo 'setuptools>=77' | $(LOCK) --output-file constraints-core.txt --constraint constraints.txt

clean:  ## remove generated files (not the environment)
	rm -rf build dist *.egg-info .pytest_cache .ruff_cache .hypothesis .import_linter_cache runs site
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +
