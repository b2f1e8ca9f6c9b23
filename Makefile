# Everything one does with a checkout. `make demo` and `make test` set up what they need.

# The Python to make .venv from, e.g. `make setup PYTHON=python3.12`; found by itself otherwise.
PYTHON ?=
BIN := .venv/bin
export PYTHON

.NOTPARALLEL:

PROGRAM := .venv/.with-program
COMPILED := .venv/.compiled
TESTS = system-packages-for-tests .venv/.with-test $(COMPILED) landmark-models
# Among them every module in KERNEL_MODULES of sd2core/numerics/compiled.py.
KERNELS := $(wildcard sd2core/numerics/*.py sd2core/body/*.py sd2core/scattering/*.py sd2core/doppler/*.py sd2core/fmcw/*.py)

.PHONY: help setup demo test test-slow lint pins fresh-machine docs format bench fuzz wheel bundle screenshots moving-picture accuracy fitting denoiser range-synthesis scale classifier real-gestures paper soak clean

help:
	@echo "make demo         set up, and open the sample recording in the window"
	@echo "make test         set up, and run the test suite (no display needed)"
	@echo "make setup        everything that developers need, in .venv"
	@echo "make pins         the pinned packages are there for every supported Python"
	@echo "make fresh-machine  the commands of the README, typed on bare systems: docs/fresh-machine.md"
	@echo "make lint         ruff, mypy and the rules between modules"
	@echo "make docs         the manual, as a site: build/docs/index.html"
	@echo "make format       let ruff format the code"
	@echo "make test-slow    the slow tests, and all examples of those that draw them"
	@echo "make bench        the benchmarks"
	@echo "make fuzz         10,000 damaged files of all kinds, each read or refused (half an hour)"
	@echo "make wheel        dist/*.whl: the program with its manual, and the library alone"
	@echo "make bundle       dist/sd2-studio/: the program with all it needs, in one folder"
	@echo "make screenshots  the pictures in docs/"
	@echo "make moving-picture  the one of the README"
	@echo "make accuracy     docs/accuracy-and-speed.md, measured (some five minutes)"
	@echo "make fitting      docs/fitting.md, measured (some ten minutes)"
	@echo "make denoiser     docs/denoiser.md, trained and measured (an hour and more; after make fitting)"
	@echo "make range-synthesis  docs/range-synthesis.md, trained (half an hour)"
	@echo "make classifier   docs/classifier.md, trained (an hour)"
	@echo "make real-gestures  docs/real-gestures.md: real radar, suggestions and classifiers (twenty minutes)"
	@echo "make paper        docs/paper.md: the paper's figures and tables (half an hour after make classifier)"
	@echo "make scale        docs/scale.md, measured (some ten minutes)"
	@echo "make soak         an hour of use of the window: memory, threads, event loop (MINUTES=60)"
	@echo "make clean        remove what the above made, .venv included"

setup: system-packages-for-tests .venv/.with-dev $(COMPILED) landmark-models
	@scripts/activation.sh always

.PHONY: system-packages system-packages-for-tests
system-packages:
	@scripts/system_packages.sh

system-packages-for-tests:
	@scripts/system_packages.sh tests

# What each purpose needs and nothing else: the program, and the extras of pyproject.toml.
$(PROGRAM): pyproject.toml constraints.txt scripts/install.py | system-packages
	@"$$(scripts/find_python.sh)" scripts/install.py
	@touch $@

.venv/.with-%: $(PROGRAM)
	@"$$(scripts/find_python.sh)" scripts/install.py $*
	@touch $@

$(COMPILED): $(PROGRAM) $(KERNELS)
	@"$$(scripts/find_python.sh)" scripts/install.py kernels
	@touch $@

# Needs a connection once; `sd2 fit` fetches them as well, and says what to do without one.
.PHONY: landmark-models
landmark-models: $(PROGRAM)
	@$(BIN)/sd2 doctor --fetch-models --if-missing > /dev/null || echo "(Only \`sd2 fit\` needs them.)"

demo: system-packages $(COMPILED)
	@scripts/activation.sh
	@scripts/demo.sh

test: $(TESTS)
	@scripts/test.sh "not slow"

test-slow: $(TESTS) .venv/.with-dev
	@SD2_EXAMPLES=thorough scripts/test.sh "slow or hypothesis"

lint: .venv/.with-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# Resolved for each Python and system, without installing anything. UPDATE=1 pins what is new.
pins: .venv/.with-dev
	@$(BIN)/python scripts/pins.py $(if $(UPDATE),--update)

fresh-machine:
	@python3 scripts/fresh_machine.py

docs: .venv/.with-docs $(COMPILED)
	$(BIN)/python -m sphinx -W --keep-going -q -d build/doctrees docs build/docs

format: .venv/.with-dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(TESTS)
	scripts/on_display.sh $(BIN)/python -m pytest tests/benchmarks --benchmark-only --timeout=0 --capture=no

fuzz: $(TESTS)
	$(BIN)/python -m tests.mutants --count 10000

# Of a plain clone, with nothing but the build backend.
wheel:
	@"$$(scripts/find_python.sh)" -m venv build/wheel-environment
	@build/wheel-environment/bin/python -m pip install --quiet --constraint constraints.txt build hatchling
	build/wheel-environment/bin/python -m build --wheel --no-isolation
	build/wheel-environment/bin/python -m build --wheel --no-isolation --outdir dist library

bundle: .venv/.with-dev $(COMPILED)
	$(BIN)/python -m PyInstaller --noconfirm --workpath build/bundle app/packaging/sd2-studio.spec

screenshots: $(TESTS)
	scripts/on_display.sh $(BIN)/python -m tools.documentation.screenshots

moving-picture: $(TESTS)
	scripts/on_display.sh $(BIN)/python -m tools.documentation.moving_picture

accuracy: setup
	$(BIN)/python -m tools.documentation.accuracy_and_speed

classifier: setup
	$(BIN)/python -m tools.documentation.studies classifier

fitting denoiser range-synthesis real-gestures paper scale: setup
	$(BIN)/python -m tools.documentation.$(subst -,_,$@)

MINUTES ?= 60
soak: $(TESTS)
	scripts/on_display.sh $(BIN)/python -m tools.documentation.soak --minutes $(MINUTES) \
		$(if $(TRAINING),--training $(TRAINING))

clean:
	rm -rf .venv build dist docs/commands .mypy_cache .ruff_cache .pytest_cache .hypothesis .benchmarks \
		.import_linter_cache
	find sd2core app tests tools -name __pycache__ -type d -prune -exec rm -rf {} +
