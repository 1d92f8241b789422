# `make demo` and `make test` do everything themselves; `make check` is what CI runs before the tests.
PYTHON ?= python3
SERVICE_PYTHON ?= /usr/bin/python3
HF     ?=
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed

# What the service runs on and nothing else, as a bill of materials (CycloneDX): from the lock it is installed by.
SBOM := $(BIN)/cyclonedx-py requirements requirements-run.lock --pyproject pyproject.toml --output-reproducible

.PHONY: demo test test-vcan test-systemd test-adversary coverage soak wheel deb install uninstall check env bench bench-discrepancy lock clean

demo: env
	$(BIN)/ema demo --out out/demo
	@echo "To type 'ema' yourself, once in each terminal: . $(BIN)/activate   (then: ema init tester work)"

# Two processes: the search for hidden effects beside all that waits for clocks and sockets, which runs one by one.
# SEARCHES=all: further cases of whole searches too; drawn: an eighth of them, by the commit, as in CI.
SEARCHES ?= few
test: env
	$(BIN)/pytest -n 2 --searches $(SEARCHES)

# On a real vcan0: this kernel's, else User-Mode Linux's (needs tools/install_system_packages).
test-vcan: env
	$(BIN)/python tools/on_vcan.py $(BIN)/pytest -m vcan tests/vcan

# The service on a machine with a real systemd, in User-Mode Linux (needs tools/install_system_packages).
test-systemd: env
	$(BIN)/pytest -m systemd tests/systemd/test_machine.py

# Attacks on a daemon process, five minutes; `make test-adversary LONG=--long` attacks more often. Writes the page's table.
LONG ?=
test-adversary: env
	$(BIN)/pytest -n 2 -m adversary tests/adversary $(LONG) --reliability docs/reliability.md

# Branch coverage of the monitor by the quick part of its tests: printed, no number is chased.
coverage: env
	$(BIN)/coverage run --branch --source ema.bus,ema.core,ema.log,ema.monitor,ema_daemon -m pytest -m "not adversary and not slow" \
	  tests/core tests/bus tests/monitor tests/log/test_round_trip.py tests/daemon/test_health.py tests/daemon/test_service.py
	$(BIN)/coverage report --skip-covered --sort cover

# A day's cycles through one daemon as fast as this machine takes them, then SIGKILL many times; needs a bundle.
SOAK_CYCLES  ?= 86400
KILL_TRIALS  ?= 100
soak: env var/bundle/manifest.json
	$(BIN)/python -m benchmarks.soak --cycles $(SOAK_CYCLES) --bundle var/bundle
	$(BIN)/python -m benchmarks.kills --trials $(KILL_TRIALS) --bundle var/bundle

var/bundle/manifest.json: config/builder-quick.yaml
	$(BIN)/ema build --config config/builder-quick.yaml --out var/bundle

check: env
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench-discrepancy: env
	$(BIN)/python -m benchmarks.discrepancy
	$(BIN)/python -m benchmarks.discrepancy_axis

bench: env
	$(BIN)/python -m benchmarks

env: $(STAMP)

$(STAMP): requirements.lock pyproject.toml
	$(PYTHON) tools/check_python.py
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $@

# The service: its own virtual environment, units, network and sysctl files; DESTDIR=, PREFIX=, see tools/install_service.
wheel: env
	rm -rf build dist
	$(BIN)/python -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .
	$(SBOM) --output-file dist/ema-monitor.cdx.json
	rm -rf build *.egg-info  # found first by a Python that runs in this folder

# HF=--hf: with the HF worker beside the monitor, and the compiler it needs.
install: wheel
	PYTHON=$(SERVICE_PYTHON) tools/install_service install dist/*.whl $(HF)

deb: wheel
	PYTHON=$(SERVICE_PYTHON) tools/build_deb dist/*.whl dist $(HF)

uninstall:
	tools/install_service uninstall

# Locked versions for all Pythons and platforms, with hashes (needs `uv`).
# requirements-run.lock is the installed monitor's, requirements-hf.lock the same with the HF worker's: the same versions without the tools.
COMPILE := uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-emit-find-links --quiet \
  --custom-compile-command "make lock"
lock:
	$(COMPILE) --extra all --group dev pyproject.toml -o requirements.lock
	$(COMPILE) --extra monitor --constraint requirements.lock pyproject.toml -o requirements-run.lock
	$(COMPILE) --extra build --constraint requirements.lock pyproject.toml -o requirements-hf.lock

clean:
	rm -rf $(VENV) build dist *.egg-info
