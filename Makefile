# The bench's commands. Each sets up what it needs first; "make" alone lists them.

SHELL := /bin/bash
.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help setup run test test-long fuzz test-ros test-viewers test-portability coverage lint locks references bench docs clean

SCENARIO ?= case1
ARGS ?=
PYTHON_SOURCES := src ros_ws/src tests tools
PYTEST := source ./env.sh && python3 -m pytest
INSTALL = source ./env.sh && python3 -m pip install --quiet --constraint constraints$$(grep -qs ^jazzy .venv/hsv-setup && echo -jazzy).txt
NOT_IN_TEST := long or fuzz or full_ros or portability
TESTS = $(PYTEST) -n auto --dist loadfile -m "not (graph or $(NOT_IN_TEST) $(1))" && \
	$(PYTEST) -n auto --dist loadfile --no-loadscope-reorder -m "graph and not (long $(1))" tests/graph

help: ## list these commands
	@sed -nE 's/^([a-z-]+):.*## (.*)/  make \1\t\2/p' Makefile | expand -t 26

setup: ## set everything up (PYTHON=/path/to/python3 chooses the interpreter)
	@python="$$(command -v "$${PYTHON:-python3}")" || { echo "make setup: there is no $${PYTHON:-python3}" >&2; exit 1; }; \
	exec "$$python" tools/setup.py

run: setup ## set up, then fly a scenario over DDS (SCENARIO=case1, ARGS="...")
	@source ./env.sh && exec hsv run $(SCENARIO) $(ARGS)

test: lint ## set up, check the sources, run all tests (ARGS="-k trim" chooses)
	@if [ -n '$(ARGS)' ]; then $(PYTEST) $(ARGS); else $(TESTS); fi

test-long: setup ## set up, then run the tests that take minutes (ARGS="-k damaged" chooses)
	@$(INSTALL) --requirement requirements-docs.txt --requirement requirements-web.txt
	@$(PYTEST) -n auto --dist loadfile -m long $(ARGS)

fuzz: setup ## set up, then give 10 000 mutated inputs to every reader, 300 where each starts a process (ARGS="--fuzz-inputs 1000" for fewer)
	@$(PYTEST) -n auto -m fuzz $(ARGS)

test-ros: setup ## set up, then run the tests that need a full ROS 2 installation, sourced before (ARGS="-k launch" chooses)
	@$(PYTEST) -m full_ros $(ARGS)

# Browser and node come from Debian, node's readers of bags from npm. Only what is missing is installed.
test-viewers: setup ## set up, install a browser, node and npm packages, then run the tests that need them
	@missing=; \
	command -v chromium chromium-browser google-chrome > /dev/null || missing=chromium; \
	for each in chromedriver:chromium-driver node:nodejs npm:npm; do \
		command -v "$${each%:*}" > /dev/null || missing="$$missing $${each#*:}"; \
	done; \
	[ -z "$$missing" ] || $$([ "$$(id -u)" = 0 ] || echo sudo) apt-get install -y --no-install-recommends $$missing
	@$(INSTALL) --requirement requirements-viewers.txt --requirement requirements-web.txt
	@for lock in $$(git ls-files 'tests/*/package-lock.json'); do npm ci --no-audit --no-fund --prefix "$${lock%/*}" || exit; done
	@$(PYTEST) -m viewer $(ARGS)

# Emulators, another machine's Python and all wheels come into .portability; nothing is installed on the machine.
test-portability: setup ## set up, then fly on emulated processors, another Python and other packages
	@source ./env.sh || exit; python3 tools/portability.py; missing=$$?; \
	python3 -m pytest -n 2 -m portability $(ARGS) && exit "$$missing"

# The packages that a flight is made of and those that record it, by their own tests; then gcov counts the lines of the
# core's headers that the golden flights run.
coverage: setup ## set up, then measure how much of the flight's packages and core their own tests run; fails below the floor
	@$(PYTEST) -n auto --cov --cov-report=term:skip-covered \
		-m "not (graph or viewer or reference or $(NOT_IN_TEST))" tests/{base,core,model,control,certificate,plugins,flight,bags} $(ARGS)
	@source ./env.sh && cd src/hsv && rm -rf build/coverage && HSV_CFLAGS="-O0 --coverage" \
		python3 setup.py -q build --build-base build/coverage --build-lib build/coverage/library
	@source ./env.sh && HSV_CORE=sse2 PYTHONPATH="$$PWD/src/hsv/build/coverage/library" python3 -m pytest -p no:cacheprovider \
		-m "not (long or fuzz)" tests/core/test_binding.py tests/flight/test_golden_flights.py
	@cd src/hsv && find build/coverage -name scalar.gcda -exec gcov -n {} + | grep -A 1 "'hsv/core/.*\.h'"

# Pinned by themselves, because make setup does not install them.
.venv/hsv-lint: requirements-lint.txt
	@source ./env.sh && python3 -m pip install --quiet --requirement requirements-lint.txt && touch $@

lint: setup ## set up, then check style, spelling, types and the direction of imports
	@$(MAKE) --no-print-directory --silent .venv/hsv-lint
	@source ./env.sh && clang-format --dry-run --Werror $$(git ls-files '*.c' '*.h' '*.cpp') && taplo lint --no-schema $$(git ls-files '*.toml') 2> /dev/null && \
		yamllint --strict $$(git ls-files '*.yml' '*.yaml' .yamllint) && codespell $$(git ls-files) && \
		check-jsonschema --quiet --builtin-schema vendor.github-workflows .github/workflows/*.yml
	@source ./env.sh && ruff check $(PYTHON_SOURCES) && ruff format --check --quiet $(PYTHON_SOURCES) && mypy && lint-imports --no-logo --verbose

# Versions move only if named: make locks ARGS="--upgrade-package scipy"; --upgrade moves all, those of ROS too.
LOCK := .venv/bin/uv pip compile --universal --system-certs --quiet --no-annotate --custom-compile-command "make locks"
locks: setup ## set up, then write the exact versions of all requirements to constraints.txt and constraints-jazzy.txt
	@$(LOCK) --python-version 3.11 requirements{,-ros,-test,-viewers,-docs,-web}.txt --output-file constraints.txt $(ARGS)
	@$(LOCK) --python-version 3.12 requirements{,-jazzy,-test,-viewers,-docs,-web}.txt --output-file constraints-jazzy.txt $(ARGS)

references: lint ## run all tests, then fly the reference bags of bags/reference anew: all or none
	@$(call TESTS,or reference) && python3 tools/references.py

bench: setup ## set up, then measure this machine (ARGS="--scale 0.5")
	@source ./env.sh && exec hsv bench $(ARGS)

docs: setup ## set up, then build the documentation into docs/_build (open docs/_build/index.html)
	@$(INSTALL) --requirement requirements-docs.txt --requirement requirements-web.txt
	@source ./env.sh && exec python3 -m sphinx -q -W --keep-going -b html docs docs/_build

clean: ## remove what set-up and tools made; recorded runs stay
	rm -rf .venv .portability .coverage src/hsv/build src/hsv/hsv/core/*.so ros_ws/build ros_ws/install ros_ws/log .*_cache .hypothesis docs/_build docs/reference/generated
	find $(PYTHON_SOURCES) -name __pycache__ -prune -exec rm -rf {} +
