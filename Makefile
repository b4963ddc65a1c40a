# Everything a developer runs. PYTHON=python3.12 picks the interpreter, VENV=folder the environment's place,
# UV= (empty) installs with pip even where uv is found.

PYTHON ?= python3
VENV ?= .venv
UV ?= $(shell command -v uv 2>/dev/null)
CONFIG ?= configs/planning/composite_wu6.yaml
WORKERS ?= auto
PYTEST_ARGS ?=
BENCH_VENV ?= .venv-bench
QUICK ?=

# A PYTHONPATH that another tool set (ROS does) would hide missing packages and load foreign pytest plugins.
unexport PYTHONPATH PYTHONHOME

# The version is in the stamp's name, so that another Python makes another environment. Where $(PYTHON) belongs to
# an environment, perhaps the very one to be replaced, the interpreter under it is meant.
PYTHON_FOUND := $(shell $(PYTHON) -c 'import platform, sys; \
    print(platform.python_version() + " " + getattr(sys, "_base_executable", sys.executable))' 2>/dev/null)
PYTHON_VERSION := $(firstword $(PYTHON_FOUND))
PYTHON_PATH := $(wordlist 2,99,$(PYTHON_FOUND))
STAMP := $(VENV)/.installed-$(PYTHON_VERSION)
VENV_PYTHON := $(VENV)/bin/python
PYTEST := $(VENV_PYTHON) -m pytest -n $(WORKERS) --maxprocesses 8 --dist loadfile

.PHONY: help venv demo test check-optimised check-slow check-physics check-capture captures check-browser check-native check-distributed check-sweep check-cluster check-video docs check-docs bench bench-optimizers bench-tracking compare lint constraints clean
.DEFAULT_GOAL := help

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-18s %s\n", $$1, $$2 }' Makefile

venv: $(STAMP)  ## make the environment, or bring it up to date

demo: $(STAMP)  ## run one scenario (CONFIG=...)
	$(VENV)/bin/jffsr run $(CONFIG)

test: $(STAMP)  ## run the tests (WORKERS=2, PYTEST_ARGS='-k name')
	$(PYTEST) $(PYTEST_ARGS)

# Heavier checks compute for longer than they compile: the code generator's optimisations are worth their time.
check-%: export JFFSR_TESTS_OPTIMISED = 1

check-optimised: $(STAMP)  ## run the tests with the compiler's optimisations, which `make test` leaves out
	$(PYTEST) $(PYTEST_ARGS)

check-slow: $(STAMP)  ## run the heavier checks
	$(PYTEST) -m slow $(PYTEST_ARGS)

check-physics: $(STAMP)  ## check 1,000 random robots against MuJoCo and the laws of mechanics
	$(VENV_PYTHON) tests/physics/check_physics.py
	$(PYTEST) -m physics $(PYTEST_ARGS)

check-capture: $(STAMP)  ## run the heavier checks of target, clearance and capture, and plan 100 random captures
	$(PYTEST) -m slow tests/target tests/clearance tests/capture tests/study/test_capture_runs.py $(PYTEST_ARGS)
	$(VENV_PYTHON) -m experiments.captures --count 100 --folder runs/captures-check --check

captures: $(STAMP)  ## plan a thousand random captures twice (goes on where it was stopped)
	$(VENV_PYTHON) -m experiments.captures

check-browser: $(STAMP)  ## look at pages and served replays in a real browser (installs one where there is none)
	$(if $(UV),"$(UV)" pip install --quiet --python "$(VENV_PYTHON)",\
	    "$(VENV_PYTHON)" -m pip install --quiet --no-input --disable-pip-version-check) -e '.[test,browser]' -c constraints.txt
	$(VENV_PYTHON) tests/browser/install_browser.py
	$(VENV_PYTHON) -m pytest -m browser tests/browser $(PYTEST_ARGS)

check-native: $(STAMP)  ## check the benchmark's C++ kernel against the package (needs a C++ compiler)
	$(PYTEST) -m native $(PYTEST_ARGS)

bench:  ## time rollouts against everything else that computes them (QUICK=1: some of it)
	@$(MAKE) --no-print-directory venv VENV="$(BENCH_VENV)"
	@$(if $(UV),"$(UV)" pip install --quiet --python "$(BENCH_VENV)/bin/python",\
	    "$(BENCH_VENV)/bin/python" -m pip install --quiet --no-input --disable-pip-version-check) \
	    -e '.[bench]' -c constraints.txt \
	    || echo "Not all opponents could be installed; the table says which are missing." >&2
	"$(BENCH_VENV)/bin/python" -m experiments.benchmarks $(if $(QUICK),--quick --out runs/benchmarks/rollouts.md)

compare: $(STAMP)  ## compare every optimizer on robots (goes on where it was stopped)
	$(VENV_PYTHON) -m experiments.comparison

bench-optimizers:  ## time a generation of each optimizer against evosax and pygmo
	@$(MAKE) --no-print-directory venv VENV="$(BENCH_VENV)"
	@$(if $(UV),"$(UV)" pip install --quiet --python "$(BENCH_VENV)/bin/python",\
	    "$(BENCH_VENV)/bin/python" -m pip install --quiet --no-input --disable-pip-version-check) \
	    pygmo -c constraints.txt || echo "pygmo could not be installed; the table leaves it out." >&2
	"$(BENCH_VENV)/bin/python" -m experiments.benchmarks.optimizers $(if $(QUICK),--quick --out runs/benchmarks/optimizers.md)

bench-tracking:  ## time a thousand trackers, and a tracking step against Pinocchio (QUICK=1: fewer)
	@$(MAKE) --no-print-directory venv VENV="$(BENCH_VENV)"
	@$(if $(UV),"$(UV)" pip install --quiet --python "$(BENCH_VENV)/bin/python",\
	    "$(BENCH_VENV)/bin/python" -m pip install --quiet --no-input --disable-pip-version-check) \
	    pin cmeel-eigen -c constraints.txt || echo "Pinocchio could not be installed; the table says so." >&2
	"$(BENCH_VENV)/bin/python" -m experiments.benchmarks.tracking $(if $(QUICK),--quick --out runs/benchmarks/tracking.md)

check-distributed: $(STAMP)  ## check that several processes search as one, also after a kill
	$(VENV_PYTHON) -m pytest -m distributed $(PYTEST_ARGS)

check-sweep: $(STAMP)  ## check that a sweep of 200 runs survives 20 kills, and others theirs
	$(VENV_PYTHON) -m pytest -m sweep $(PYTEST_ARGS)

check-cluster: $(STAMP)  ## check that a sweep on a dask cluster survives the loss of a worker
	@$(if $(UV),"$(UV)" pip install --quiet --python "$(VENV_PYTHON)",\
	    "$(VENV_PYTHON)" -m pip install --quiet --no-input --disable-pip-version-check) -e '.[cluster]' -c constraints.txt
	$(VENV_PYTHON) -m pytest -m cluster $(PYTEST_ARGS)

# OpenGL belongs to the system; newer systems have no OSMesa, and EGL alone will do.
OPENGL := libegl1 libgl1 libopengl0 libgl1-mesa-dri
check-video: $(STAMP)  ## draw, encode and decode videos (gets OpenGL by apt-get where it is missing)
	@has() { "$(VENV_PYTHON)" -c "import sys, ctypes.util as u; sys.exit(u.find_library('$$1') is None)"; }; \
	if ! { has EGL && has OpenGL; }; then \
	    command -v apt-get >/dev/null || { echo "make check-video needs libEGL and libOpenGL, and there is no apt-get here: install them." >&2; exit 1; }; \
	    as_root=$$([ "$$(id -u)" = 0 ] || echo sudo); \
	    $$as_root apt-get update -q && $$as_root apt-get install -q -y --no-install-recommends $(OPENGL) \
	        || { echo "make check-video could not install $(OPENGL): install them, then repeat it." >&2; exit 1; }; \
	    $$as_root apt-get install -q -y --no-install-recommends libosmesa6 || true; \
	fi
	$(VENV_PYTHON) -m pytest -m video $(PYTEST_ARGS)

docs: $(STAMP)  ## build the documentation into site/ (open site/index.html)
	@$(if $(UV),"$(UV)" pip install --quiet --python "$(VENV_PYTHON)",\
	    "$(VENV_PYTHON)" -m pip install --quiet --no-input --disable-pip-version-check) -e '.[docs]' -c constraints.txt
	$(VENV)/bin/zensical build --strict --clean

check-docs: docs  ## build the documentation, look for what it asks of the network, and run every example on it
	$(VENV_PYTHON) -m pytest -m docs $(PYTEST_ARGS)

lint: $(STAMP)  ## check style and format
	$(VENV_PYTHON) -m ruff check .
	$(VENV_PYTHON) -m ruff format --check .

# The list must not name a registry: whoever installs uses their own.
constraints:  ## choose the pinned versions anew (needs uv)
	@test -n "$(UV)" || { echo "make constraints needs uv on PATH (pip install uv)." >&2; exit 1; }
	"$(UV)" pip compile --quiet --universal --upgrade --extra test --extra cluster --extra browser --extra docs --python-version 3.11 --no-header --no-annotate \
	    --no-emit-index-url --no-emit-find-links --output-file constraints.txt pyproject.toml
	@! grep -nE '://|^-| @ ' constraints.txt || { echo "constraints.txt names a registry or a path." >&2; exit 1; }

clean:  ## remove the environment, caches and build products (never runs/)
	@if [ -f "$(VENV)/pyvenv.cfg" ]; then rm -rf "$(VENV)"; fi
	rm -rf build dist *.egg-info .pytest_cache .ruff_cache
	find jffsr tests experiments -name __pycache__ -type d -prune -exec rm -rf {} + 2>/dev/null || true

# An environment is always made whole, so that nothing of the last one stays behind; a folder that is not one is
# left alone. Sources are translated here, for where PYTHONDONTWRITEBYTECODE is set, every start would do so again.
$(STAMP): pyproject.toml constraints.txt
	@case "$(PYTHON_VERSION)" in 3.11.*|3.12.*|3.13.*) ;; *) \
	    echo "jffsr needs Python 3.11, 3.12 or 3.13, but $(PYTHON) is $(or $(PYTHON_VERSION),missing or broken): name another one, for example make $(or $(MAKECMDGOALS),venv) PYTHON=python3.12" >&2; \
	    exit 1 ;; esac
	@if [ -f "$(VENV)/pyvenv.cfg" ]; then rm -rf "$(VENV)"; fi
	@if [ -e "$(VENV)" ] && ! rmdir "$(VENV)" 2>/dev/null; then \
	    echo "$(VENV) exists and is not a Python environment: remove it or name another place with VENV=." >&2; exit 1; fi
	@echo "Installing jffsr for Python $(PYTHON_VERSION) into $(VENV) (this can take a minute or two)"
	@set -e; \
	if [ -n "$(UV)" ]; then \
	    "$(UV)" venv --quiet --python "$(PYTHON_PATH)" "$(VENV)"; \
	    "$(UV)" pip install --quiet --compile-bytecode --python "$(VENV_PYTHON)" -e '.[test]' -c constraints.txt; \
	else \
	    "$(PYTHON_PATH)" -m venv "$(VENV)"; \
	    "$(VENV_PYTHON)" -m pip install --quiet --no-input --disable-pip-version-check -e '.[test]' -c constraints.txt; \
	fi
	@"$(VENV_PYTHON)" -m compileall -q jffsr || true
	@touch $@
