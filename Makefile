# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
# Two commands do everything: `make demo` and `make test`. `make check` is for every day: lint, types
# and the quick tests. Each makes the .venv it needs. tests/README.md says more.
# Python 3.11 or 3.12; PYTHON=… on the command line names another one of these.
PYTHON ?= $(shell for p in python3.12 python3.11 python3; do \
	"$$p" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 12))' 2>/dev/null \
	&& echo "$$p" && break; done)
VENV := .venv
BIN := $(VENV)/bin
WORKERS ?= 2

.PHONY: demo check test lint types mutants coverage simulators docs clean
.DELETE_ON_ERROR:

demo: $(VENV)/.ready
	$(BIN)/engb demo --out out/demo

test: $(VENV)/.ready lint types
	$(BIN)/python -m pytest -q -n $(WORKERS) -m 'not real_time' tests
	# Real time, after the others: three at a time leave each other time enough, as most only wait.
	ROS_PYTHON_CHECK_FIELDS=1 $(BIN)/python -m pytest -q -n 3 -m real_time tests/ros tests/can_bus

check: $(VENV)/.ready lint types
	$(BIN)/python -m pytest -q -n $(WORKERS) -m 'not slow' tests

# Mutation testing of what stands between a wrong number and the brake; MODULES='pid clamp' for some.
mutants: $(VENV)/.mutants
	$(BIN)/python -m tests.mutants.run --jobs $(WORKERS) $(MODULES)

# Statements and branches that tests reach, in the processes that they start as well, nodes among
# them, and with other people's simulators, which some of the tests need. All of the last line of
# defence (the modules of tests/mutants, and the bus) has to be reached, of all together what was
# reached before (FLOOR, per cent of statements and branches together). CHOSEN='not slow' is what CI
# does: quick tests, then those in real time, an hour on two processors; CHOSEN='slow or not slow' is
# all. COVERED='tests/control tests/can_bus' FLOOR=0 is enough for the last line of defence.
LAST_LINE := engb_core/control/final_clamp.py,engb_core/control/pid.py,engb_core/control/torque_watch.py,engb_core/control/state_watch.py,engb_core/control/supervisor.py,engb_ros/can/*
COVERED ?= $(addprefix tests/,bags bench can_bus commands control core diagnose docs export fleet identify kinematics laws \
	proof report reproduce ros simulators tables)
CHOSEN ?= not slow
FLOOR ?= 96

coverage: $(VENV)/.coverage $(VENV)/.simulators
	$(BIN)/python -m coverage erase
	$(BIN)/python -m coverage run -m pytest -q -m '($(CHOSEN)) and not real_time' $(COVERED)
	$(BIN)/python -m coverage run -m pytest -q -m real_time $(COVERED) || test $$? -eq 5
	$(BIN)/python -m coverage combine --quiet
	$(BIN)/python -m coverage report --ignore-errors --fail-under=$(FLOOR)
	$(BIN)/python -m coverage report --show-missing --include='$(LAST_LINE)' --fail-under=100

# With other people's simulators: what `engb export` makes, run in FMPy and MuJoCo (PyPI, 0.2 GB).
simulators: $(VENV)/.simulators
	$(BIN)/python -m pytest -q -n $(WORKERS) tests/export tests/simulators

# The documentation as a site, out/site; a warning is an error.
docs: $(VENV)/.docs
	$(BIN)/python docs/make_site.py out/site

lint: $(VENV)/.ready
	$(BIN)/ruff check .

types: $(VENV)/.ready
	$(BIN)/mypy

$(VENV)/.ready: setup.py requirements.txt
	@test -n "$(PYTHON)" || { echo 'Python 3.11 or 3.12 is needed (PYTHON=… names one)' >&2; exit 2; }
	$(PYTHON) -m venv $(VENV)
	@echo 'Installing into $(VENV), 1.1 GB: each package is named as it comes.'
	$(BIN)/python -m pip install --disable-pip-version-check -r requirements.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps -e .
	touch $@

$(VENV)/.mutants: $(VENV)/.ready
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation -e '.[mutants]'
	touch $@

$(VENV)/.coverage: $(VENV)/.ready
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation -e '.[coverage]'
	touch $@

$(VENV)/.docs: $(VENV)/.ready
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation -e '.[docs]'
	touch $@

$(VENV)/.simulators: $(VENV)/.ready
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation -e '.[simulators]'
	touch $@

clean:
	rm -rf $(VENV) build install log out
