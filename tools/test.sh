#!/bin/sh
# All tests, after `make` has built what they need: the firmware's units on this computer (plain and with sanitizers),
# the simulator with sanitizers, then everything that pytest runs. Ends with pytest's summary.
set -eu
cd "$(dirname "$0")/.."

tools/pio test -e native -e native_quad -e native_sanitized
tools/test_sanitized.sh
exec build/venv/bin/python -m pytest "$@"
