# boebot: `make run` shows the whole circle, `make test` proves it, `make help` lists the rest.
#
# Everything is set up on the way: system packages (Debian, Ubuntu), a virtual environment under build/venv, the
# firmware images, the compiled parts. Files named .done-* below build/ say what is finished; the second
# time nothing is done again.

JOBS := $(shell nproc 2>/dev/null || echo 2)
VENV := build/venv
PYTHON_VENV := $(VENV)/bin/python
# Steps that do not depend on each other run side by side; what a step prints stays together.
SIDE_BY_SIDE := $(MAKE) --no-print-directory --jobs=$(JOBS) --output-sync=target
PIP := $(PYTHON_VENV) -m pip install --quiet --no-compile --disable-pip-version-check --no-warn-script-location \
	--constraint requirements.lock

# Made by protocol/generate.py. Of the headers in firmware/src/generated one is named here; it makes them all.
GENERATED := firmware/src/generated/messages.h host/boebot/link/messages.py host/boebot_can/layout.py host/boebot/devices/attributes.pyi sim_bridge/world/generated/noise_layers.h
GENERATED_FROM := $(wildcard protocol/*.py host/*/generator/*.py sim_bridge/world/generator/*.py protocol/*.toml protocol/robots/*.toml host/boebot/devices/*.py) firmware/src/tasks.def
FIRMWARE_SOURCES := $(sort $(firstword $(GENERATED)) $(shell find firmware/src -name '*.[ch]' -o -name '*.def'))
CORE_SOURCES := $(shell find host sim_bridge -name '[!_]*.[ch]' -o -name '*.def' -o -name 'build_*.py')
ARENA_SCHEMA := host/boebot/arenas/bundled/schema.json
# A library that sketches in tests use.
SERVO := build/cache/libraries/Servo/Servo.h
# The firmware for each pin map, and the boot loader.
ENVIRONMENTS := $(shell sed -n 's/^default_envs = //p' platformio.ini | tr -d ,) bootloader
IMAGES := $(ENVIRONMENTS:%=build/images/%.elf)
# What setup.py compiles. Where some of it is not there, it is made anew.
COMPILED := sim_bridge/_core sim_bridge/boards/avr/_avr host/boebot/arenas/_arena host/boebot/link/_codec
COMPILED += $(patsubst %,sim_bridge/images/firmware-%,$(filter-out bootloader,$(ENVIRONMENTS)))
ifneq ($(strip $(foreach one,$(COMPILED),$(if $(wildcard $(one).*so),,$(one)))),)
$(shell rm -f build/.done-core)
endif
# The one that `make run` runs; the others are built when something needs them all.
SHOWN := build/images/shieldbot.elf
BUILD_SHOWN := tools/pio run --silent -e shieldbot
BUILD_IMAGES := tools/pio run --silent $(addprefix -e ,$(ENVIRONMENTS))

export PIP_DISABLE_PIP_VERSION_CHECK := 1
export HYPOTHESIS_STORAGE_DIRECTORY := build/hypothesis
# pip compiles nothing (--no-compile): each module is compiled when it is first needed, and that is kept. Hundreds of
# processes that start Python, matplotlib or PlatformIO would compile it all again each time.
unexport PYTHONDONTWRITEBYTECODE

.DELETE_ON_ERROR:
.PHONY: help run test check bench soak fuzz experiments wheel wheels firmware pictures timing format setup clean lock

help:
	@echo "make run       build what it takes, let the demonstration brain drive the emulated robot, write build/run"
	@echo "make test      all tests: Python, firmware units, whole circle, wheel"
	@echo "make check     formatting, types, static analysis, warnings as errors, generated files"
	@echo "make bench     the figures, as a table and in build/bench.json; ONLY=laser for some, PAGE=FILE for a page of the docs"
	@echo "make soak      what takes long: all experiments at seed 1 and at others (SEEDS=2 3 4 5 6 7 8 9 10), a run in the emulator (SECONDS=3600), the longest tasks of many seeds, other compilers and emulators, tests with each protection left out, the board's tests again and again while all cores are busy, error rates"
	@echo "make fuzz      many more random cases for the tests that take random input, FUZZ_SECONDS=60 of each fuzzer"
	@echo "make firmware  build/images/*.elf and *.hex, built by PlatformIO"
	@echo "make wheel     dist/*.whl, with images and arenas inside"
	@echo "make wheels    dist/*.whl for Linux, Windows and macOS, and what is inside; ONLY=win_amd64 for one of them"
	@echo "make experiments  all experiments of the notes, and a page of them, build/experiments/index.md"
	@echo "make pictures  the pictures of the documentation, and the pages of experiments and of the timing"
	@echo "make timing    what the pages of the timing show: bounds and measurements, a tick drawn to scale"
	@echo "make format    format all sources"
	@echo "make setup     only what run, test and check need; do no more"
	@echo "make clean     remove everything that was built"

# ---- what people call --------------------------------------------------------------------------------------------

run:
	@$(SIDE_BY_SIDE) ready-run
	@$(VENV)/bin/boebot run demo --on avr --seconds 60 --out build/run
	@echo "Look at build/run/run.png, and open build/run/replay.html in a browser to play the run."
	@echo "Watch one while it drives:  $(VENV)/bin/boebot run demo --view"

test:
	@$(SIDE_BY_SIDE) ready-test
	@tools/test.sh

check:
	@$(SIDE_BY_SIDE) ready-check
	@$(SIDE_BY_SIDE) --keep-going check-types check-python check-examples check-format check-static check-warnings check-generated
	@echo "check: all passed"

bench:
	@$(SIDE_BY_SIDE) ready-bench
	@$(PYTHON_VENV) -m tools.tests.bench $(if $(ONLY),--only "$(ONLY)") $(if $(PAGE),--page $(PAGE))

experiments:
	@$(SIDE_BY_SIDE) ready-kit
	@$(VENV)/bin/boebot experiment --all --out build/experiments

SECONDS ?= 3600
SEEDS ?= 2 3 4 5 6 7 8 9 10
soak: experiments
	@$(SIDE_BY_SIDE) ready-soak
	@failed=0; for seed in $(SEEDS); do echo "Experiments at seed $$seed"; \
	  $(VENV)/bin/boebot experiment --all --seed $$seed --out build/experiments/seed-$$seed || failed=1; done; exit $$failed
	@$(VENV)/bin/boebot run wander --on avr --arena room --seconds $(SECONDS) --out build/soak
	@$(PYTHON_VENV) -m tools.tests.qemu
	@$(PYTHON_VENV) -m pytest -q -m soak -o faulthandler_timeout=1800
	@for core in $$(seq $(JOBS)); do while kill -0 $$$$ 2>/dev/null; do :; done & done; \
	  for run in $$(seq 60); do [ $$run -le 50 ] && on=native || on=avr; \
	  $(VENV)/bin/boebot test --on $$on -q >build/busy.log 2>&1 || \
	  { cat build/busy.log; echo "All cores busy: run $$run of boebot test, on $$on, has failed"; exit 1; }; done
	@PYTHONMALLOC=malloc tools/test_sanitized.sh
	@tools/pio test -e native_quad
	@tools/warnings.sh all
	@tools/pio check -e native --fail-on-defect low --fail-on-defect medium --fail-on-defect high
	@$(PYTHON_VENV) -m tools.tests.error_rates --page docs/reference/error-rates.md

EXAMPLES ?= 5000
FUZZ_SECONDS ?= 60
fuzz:
	@$(SIDE_BY_SIDE) ready-test
	@tools/test_sanitized.sh
	@$(PYTHON_VENV) -m tools.tests.fuzz --seconds $(FUZZ_SECONDS)
	@$(PYTHON_VENV) host/fuzz/damaged_records.py
	@BOEBOT_EXAMPLES=$(EXAMPLES) $(PYTHON_VENV) -m pytest -q -m hypothesis -o faulthandler_timeout=1800

DISTANCE := distance/distance.ino --robot shieldbot --arena room --seconds 17
pictures:
	@$(SIDE_BY_SIDE) ready-test
	@mkdir -p build/pictures
	@$(VENV)/bin/boebot run demo --on native --seconds 60 --out build/pictures/demo
	@cp build/pictures/demo/run.png docs/images/demo.png
	@sed -n '/^# echoes.py/,/^```$$/{/^```$$/!p}' README.md >build/pictures/echoes.py
	@cd build/pictures && $(CURDIR)/$(VENV)/bin/boebot run echoes.py --seconds 120 --out echoes
	@cp build/pictures/echoes/run.png docs/images/echoes.png
	@$(VENV)/bin/boebot run explore --seconds 1000 --out build/pictures/explored
	@cp build/pictures/explored/run.png docs/images/explored.png
	@$(PYTHON_VENV) -m tools.arena_pages --pictures
	@$(VENV)/bin/boebot show robot shieldbot --out docs/images/robot-shieldbot.svg
	@$(VENV)/bin/boebot show robot rover --out docs/images/robot-rover.svg
	@sed -n '/^# sweep.py/,/^```$$/{/^```$$/!p}' docs/how-to/thousands-of-runs.md >build/pictures/sweep.py
	@cd build/pictures && $(CURDIR)/$(PYTHON_VENV) sweep.py && cp sweep.png $(CURDIR)/docs/images/sweep.png
	@sed -n '/^# matters.toml/,/^```$$/{/^```$$/!p}' docs/how-to/what-matters.md >build/pictures/matters.toml
	@cd build/pictures && $(CURDIR)/$(VENV)/bin/boebot matters matters.toml && cp matters/matters.png $(CURDIR)/docs/images
	@sed -n '/^# utilities.toml/,/^```$$/{/^```$$/!p}' docs/how-to/evolve.md >build/pictures/utilities.toml
	@cd build/pictures && $(CURDIR)/$(VENV)/bin/boebot evolve utilities.toml && cp utilities/curve.png $(CURDIR)/docs/images/evolve.png
	@$(VENV)/bin/boebot run wander --arena room --seconds 30 --out build/pictures/can
	@$(VENV)/bin/boebot report build/pictures/can --as can.log --quiet
	@$(VENV)/bin/boebot can dbc build/pictures/boebot.dbc
	@$(VENV)/bin/cantools plot build/pictures/boebot.dbc telemetry_5.ping_echo --ignore-unknown-frames -o docs/images/can-plot.png <build/pictures/can/can.log
	@rm -rf build/pictures/distance && cd build/pictures && $(CURDIR)/$(VENV)/bin/boebot new distance --sketch
	@cd build/pictures && $(CURDIR)/$(VENV)/bin/boebot run $(DISTANCE) --out sketch
	@cp build/pictures/sketch/run.png docs/images/sketch-distance.png
	@cd build/pictures && sed -i 's/delay(50)/delay(2000)/' distance/distance.ino && $(CURDIR)/$(VENV)/bin/boebot run $(DISTANCE) --out sketch
	@cp build/pictures/sketch/run.png docs/images/sketch-blind.png
	@$(PYTHON_VENV) -m tools.live_pictures
	@$(PYTHON_VENV) -m boebot_course.pages
	@$(MAKE) --no-print-directory timing

timing:
	@$(SIDE_BY_SIDE) ready-kit
	@$(VENV)/bin/boebot timing --out build/timing >build/timing.log
	@cp build/timing/timing.svg docs/images/timing.svg
	@$(PYTHON_VENV) -m tools.shown_output docs/how-to/timing.md docs/reference/timing.md

firmware: ready-firmware

wheel:
	@$(SIDE_BY_SIDE) ready-kit
	@rm -rf build/bdist.* build/lib.* # the wheel links the same objects as the checkout
	@$(PYTHON_VENV) -m pip wheel --quiet --no-index --no-deps --no-build-isolation --wheel-dir dist .
	@ls dist/*.whl

wheels:
	@$(SIDE_BY_SIDE) ready-wheels
	@$(PYTHON_VENV) -m tools.wheels $(ONLY)

format:
	@$(SIDE_BY_SIDE) ready-check
	@$(PYTHON_VENV) -m ruff format --quiet .
	@$(PYTHON_VENV) -m ruff check --quiet --fix .
	@$(VENV)/bin/clang-format -i $$(tools/c_sources.sh)

setup:
	@$(SIDE_BY_SIDE) ready-test ready-check

clean:
	@rm -rf build dist host/boebot/data sim_bridge/images host/*.egg-info *.egg-info
	@rm -rf firmware/src/generated $(GENERATED) $(ARENA_SCHEMA)
	@find host sim_bridge -name '*.so' -delete
	@find . -name __pycache__ -not -path './.git/*' -prune -exec rm -rf {} +

lock:
	@rm -rf build/lock-venv && $$(tools/find_python.sh) -m venv build/lock-venv
	@build/lock-venv/bin/pip install --quiet \
		$$(build/lock-venv/bin/python tools/requirements.py build run can firmware foxglove test browser bench check wheels)
	@{ sed -n 1p requirements.lock; build/lock-venv/bin/pip freeze --all --exclude pip --exclude wheel; } >build/requirements.lock
	@mv build/requirements.lock requirements.lock

# ---- single checks -----------------------------------------------------------------------------------------------

.PHONY: check-python check-types check-examples check-format check-static check-warnings check-generated
check-python:
	@$(PYTHON_VENV) -m ruff check --quiet .
	@$(PYTHON_VENV) -m ruff format --check --quiet . || { echo "run: make format"; exit 1; }
	@$(PYTHON_VENV) -m tools.house --check
check-types:
	@$(PYTHON_VENV) -m mypy --no-error-summary
check-examples:
	@$(PYTHON_VENV) -m tools.examples
check-format:
	@$(VENV)/bin/clang-format --dry-run -Werror $$(tools/c_sources.sh)
check-static:
	@tools/static_analysis.sh
check-warnings:
	@tools/warnings.sh
check-generated:
	@$(PYTHON_VENV) protocol/generate.py --check

# ---- steps ---------------------------------------------------------------------------------------------------------

.PHONY: ready-run ready-kit ready-test ready-bench ready-soak ready-check ready-firmware ready-wheels
ready-run: $(GENERATED) $(VENV)/.done-boebot build/.done-core $(ARENA_SCHEMA) $(SHOWN)
ready-kit: ready-run $(IMAGES)
ready-test: ready-kit build/.done-system-test $(VENV)/.done-test build/wheelhouse/.done build/.done-sketches
ready-bench: ready-test build/.done-system-bench build/mcap-core/.done
ready-soak: ready-bench ready-wheels build/.done-system-soak
ready-check: $(GENERATED) build/.done-system-check $(VENV)/.done-check build/platformio-core/appstate.json
ready-firmware: $(IMAGES)
ready-wheels: ready-kit $(VENV)/.done-wheels

build/.done-system-%: tools/setup_system.sh tools/find_python.sh
	@mkdir -p build
	@tools/setup_system.sh $*
	@touch $@
# one apt at a time
build/.done-system-test: build/.done-system-run
build/.done-system-check: build/.done-system-test
build/.done-system-soak: build/.done-system-test

$(VENV)/.done-venv: build/.done-system-run
	@echo "Making a virtual environment in $(VENV)"
	@rm -rf $(VENV)
	@$$(tools/find_python.sh) -m venv $(VENV)
	@touch $@

# PlatformIO first: the firmware is built while the rest is installed. One pip at a time.
DECLARED := requirements.lock pyproject.toml
INSTALL = $(PIP) $$($(PYTHON_VENV) tools/requirements.py $(1)) && touch $@
$(VENV)/.done-firmware: $(VENV)/.done-venv $(DECLARED)
	@echo "Installing PlatformIO and the build tools"
	@$(call INSTALL,build firmware)
$(VENV)/.done-run: $(VENV)/.done-firmware $(DECLARED)
	@echo "Installing Python packages"
	@$(call INSTALL,run)
$(VENV)/.done-test: $(DECLARED) | $(VENV)/.done-boebot
	@echo "Installing Python packages for tests"
	@$(call INSTALL,can foxglove test browser)
$(VENV)/.done-bench: $(DECLARED) | $(VENV)/.done-test
	@echo "Installing what the bench compares with"
	@$(call INSTALL,bench)
$(VENV)/.done-check: $(DECLARED) | $(VENV)/.done-test
	@echo "Installing Python packages for checks"
	@$(call INSTALL,check)
$(VENV)/.done-boebot: pyproject.toml $(VENV)/.done-run | build/.done-core
	@rm -rf boebot.egg-info
	@$(PIP) --no-index --no-deps --no-build-isolation --editable .
	@touch $@

$(VENV)/.done-wheels: $(DECLARED) | $(VENV)/.done-boebot
	@echo "Installing the compiler of wheels"
	@$(call INSTALL,wheels)

# What an installation without a network takes its packages from (tools/tests/test_wheel.py).
build/wheelhouse/.done: $(DECLARED) | $(VENV)/.done-test
	@$(PYTHON_VENV) -m pip download --quiet --only-binary :all: --dest build/wheelhouse --constraint requirements.lock \
		$$($(PYTHON_VENV) tools/requirements.py run hil)
	@touch $@

# Another program's reader of records (host/tests/record/test_blocks.py), with the hashes of its lock file.
build/mcap-core/.done: $(addprefix host/tests/mcap_core/,package.json package-lock.json) $(VENV)/.done-bench
	@mkdir -p $(@D) && cp $(filter %.json,$^) $(@D)
	@PATH="$(VENV)/bin:$$PATH" npm ci --prefix $(@D) --ignore-scripts --no-audit --no-fund --silent
	@touch $@

build/.done-core: setup.py pyproject.toml $(CORE_SOURCES) $(FIRMWARE_SOURCES) $(VENV)/.done-firmware
	@echo "Compiling the simulated world and the emulated boards"
	@$(PYTHON_VENV) setup.py --quiet build_ext --inplace >build/core.log 2>&1 || { cat build/core.log; exit 1; }
	@touch $@

$(SERVO): | $(VENV)/.done-boebot
	@BOEBOT_CACHE=build/cache $(PYTHON_VENV) -c 'from boebot.sketch import servo; servo.libraries()'

# Those that tests drive, built once.
build/.done-sketches: $(SERVO) $(wildcard host/boebot/sketches/*/*.ino)
	@echo "Building the bundled sketches"
	@BOEBOT_CACHE=build/cache $(PYTHON_VENV) -c 'from boebot import sketches; from boebot.sketch.build import built; \
		[built(sketches.FOLDER / name) for name in sketches.NAMES]'
	@touch $@

$(ARENA_SCHEMA): host/boebot/arenas/description.py tools/arena_pages.py | $(VENV)/.done-boebot
	@$(PYTHON_VENV) -m tools.arena_pages --schema

build/platformio-core/appstate.json: tools/prepare_platformio.py $(VENV)/.done-firmware \
		host/boebot/sketch/core_directory.py $(shell find tools/platformio host/boebot/sketch/platforms -name '*.py' -o -name '*.json')
	@$(PYTHON_VENV) tools/prepare_platformio.py

build/.done-generated: $(GENERATED_FROM) build/.done-system-run
	@$$(tools/find_python.sh) protocol/generate.py
	@touch $@
# A file that would be the same keeps its time, and what is made from it is not made again.
$(sort $(GENERATED) $(filter firmware/src/generated/%,$(FIRMWARE_SOURCES))): build/.done-generated
	@test -e $@ || $$(tools/find_python.sh) protocol/generate.py

build/.done-shown: platformio.ini tools/pio build/platformio-core/appstate.json $(FIRMWARE_SOURCES)
	@echo "Building a firmware image"
	@$(BUILD_SHOWN)
	@touch $@
build/.done-images: build/.done-shown $(wildcard firmware/bootloader/*.c)
	@echo "Building all firmware images"
	@$(BUILD_IMAGES)
	@touch $@
$(SHOWN): build/.done-shown
	@test -e $@ || $(BUILD_SHOWN)
$(filter-out $(SHOWN),$(IMAGES)): build/.done-images
	@test -e $@ || $(BUILD_IMAGES)
