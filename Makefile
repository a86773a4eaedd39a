# The bench's commands. Each sets up what it needs first; "make" alone lists them.

SHELL := /bin/bash
.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help setup run test test-long fuzz test-ros test-viewers test-portability coverage lint references bench docs clean

SCENARIO ?= case1
ARGS ?=
IN_ENVIRONMENT := source ./env.sh && exec
PYTHON_SOURCES := src ros_ws/src tests tools

help: ## list these commands
	@sed -nE 's/^([a-z-]+):.*## (.*)/  make \1\t\2/p' Makefile | expand -t 26

setup: ## set everything up (PYTHON=/path/to/python3 chooses the interpreter)
	@python="$${PYTHON:-python3}"; \
	if ! command -v "$$python" > /dev/null; then \
		echo "make setup: there is no $$python: sudo apt-get install python3 python3-venv python3-dev g++ make cmake" >&2; \
		exit 1; \
	fi; \
	exec "$$python" tools/setup.py

run: setup ## set up, then fly a scenario over DDS (SCENARIO=case1, ARGS="...")
	@$(IN_ENVIRONMENT) hsv run $(SCENARIO) $(ARGS)

test: lint ## set up, check the sources, run all tests (ARGS="-k trim" chooses)
	@source ./env.sh && if [ -n '$(ARGS)' ]; then exec python3 -m pytest $(ARGS); fi; \
	python3 -m pytest -n auto -m "not (graph or long or fuzz or full_ros or portability)" && exec python3 -m pytest -n auto --dist loadfile --no-loadscope-reorder -m "graph and not long"

test-long: setup ## set up, then run the tests that take minutes (ARGS="-k damaged" chooses)
	@$(IN_ENVIRONMENT) python3 -m pytest -n auto -m long $(ARGS)

fuzz: setup ## set up, then give 10 000 mutated files to every reader (ARGS="--fuzz-inputs 1000" for fewer)
	@$(IN_ENVIRONMENT) python3 -m pytest -n auto -m fuzz $(ARGS)

# In a shell with the wheels' ROS too, if the tools of an installation built for it are on PATH.
test-ros: setup ## set up, then run the tests that need a full ROS 2 installation, sourced before (ARGS="-k launch" chooses)
	@$(IN_ENVIRONMENT) python3 -m pytest -m full_ros $(ARGS)

# Browser and node come from Debian, node's readers of bags from npm. Of them only what is missing is installed: a node
# from elsewhere brings its own npm, beside which that of Debian cannot be; where apt-get is not wanted, install before.
test-viewers: setup ## set up, install a browser, node and npm packages, then run the tests that need them
	@missing=; \
	command -v chromium chromium-browser google-chrome > /dev/null || missing=chromium; \
	for each in chromedriver:chromium-driver node:nodejs npm:npm; do \
		command -v "$${each%:*}" > /dev/null || missing="$$missing $${each#*:}"; \
	done; \
	if [ -n "$$missing" ]; then \
		$$([ "$$(id -u)" = 0 ] || echo sudo) apt-get install -y --no-install-recommends $$missing; \
	fi
	@pins=constraints$$([ "$$ROS_DISTRO" = jazzy ] && echo -jazzy).txt; \
	$(IN_ENVIRONMENT) python3 -m pip install --quiet --requirement requirements-viewers.txt --constraint "$$pins"
	@for lock in $$(git ls-files 'tests/*/package-lock.json'); do npm ci --no-audit --no-fund --prefix "$${lock%/*}" || exit; done
	@$(IN_ENVIRONMENT) python3 -m pytest -m viewer $(ARGS)

# Emulators, another machine's Python and all wheels come into .portability; nothing is installed on the machine.
test-portability: setup ## set up, then fly on emulated processors, another Python and other packages
	@source ./env.sh || exit; python3 tools/portability.py; missing=$$?; \
	python3 -m pytest -n 2 -m portability $(ARGS) && exit "$$missing"

# Of the packages that a flight is made of and of those that record it, by the tests that mirror them, in one process each:
# some minutes. Then gcov counts the lines of the core's headers that the golden flights and vectors run.
coverage: setup ## set up, then measure how much of the flight's packages and core their own tests run; fails below the floor
	@$(IN_ENVIRONMENT) python3 -m pytest -n auto --cov --cov-report=term:skip-covered \
		-m "not (graph or long or fuzz or full_ros or portability or viewer or reference)" \
		tests/{base,core,model,control,flight,bags} $(ARGS)
	@source ./env.sh && cd src/hsv && rm -rf build/coverage && HSV_CFLAGS="-O0 --coverage" \
		python3 setup.py -q build --build-base build/coverage --build-lib build/coverage/library
	@source ./env.sh && HSV_CORE=sse2 PYTHONPATH="$$PWD/src/hsv/build/coverage/library" python3 -m pytest -p no:cacheprovider \
		-m "not (long or fuzz)" tests/core/test_vectors.py tests/core/test_binding.py tests/flight/test_golden_flights.py
	@cd src/hsv && find build/coverage -name scalar.gcda -exec gcov -n {} + | grep -A 1 "'hsv/core/.*\.h'"

lint: setup ## set up, then check style, types and the direction of imports
	@source ./env.sh && ruff check $(PYTHON_SOURCES) && ruff format --check --quiet $(PYTHON_SOURCES) && mypy && lint-imports --no-logo --verbose

references: lint ## run all tests, then fly the reference bags of bags/reference anew: all or none
	@source ./env.sh && python3 -m pytest -n auto -m "not (reference or long or fuzz or full_ros or portability or graph)" && \
	python3 -m pytest -n auto --dist loadfile --no-loadscope-reorder -m "graph and not (reference or long)" && python3 tools/references.py

# Without a package index everything else is measured all the same.
bench: setup ## set up, then measure this machine; replaces the table in docs/benchmarks.md (ARGS="--scale 0.5")
	-@pins=constraints$$([ "$$ROS_DISTRO" = jazzy ] && echo -jazzy).txt; \
	$(IN_ENVIRONMENT) python3 -m pip install --quiet --requirement requirements-bench.txt --constraint "$$pins"
	@$(IN_ENVIRONMENT) hsv bench --out docs/benchmarks.md $(ARGS)

docs: setup ## set up, then build the documentation into docs/_build (open docs/_build/index.html)
	@pins=constraints$$([ "$$ROS_DISTRO" = jazzy ] && echo -jazzy).txt; \
	$(IN_ENVIRONMENT) python3 -m pip install --quiet --requirement requirements-docs.txt --constraint "$$pins"
	@$(IN_ENVIRONMENT) python3 -m sphinx -q -W --keep-going -b html docs docs/_build

clean: ## remove what set-up and tools made; recorded runs stay
	rm -rf .venv .portability .coverage src/hsv/build src/hsv/hsv/core/*.so ros_ws/build ros_ws/install ros_ws/log .pytest_cache .mypy_cache .ruff_cache .hypothesis docs/_build docs/reference/generated
	find $(PYTHON_SOURCES) -name __pycache__ -prune -exec rm -rf {} +
