#!/bin/sh
# All tests, after `make` has built what they need: tools/test.sh [ARGUMENT OF PYTEST...]
# Three parts side by side, each into build/test-PART.log: Python's tests of host without the timing, and the rest of
# them; the firmware's units. Then, when nothing else computes, the tests that look at the wall clock, four files at
# a time, as they mostly wait.
set -eu
cd "$(dirname "$0")/.."

failed=0
echo "Testing, each into build/test-PART.log: host, others, units"
# Ctrl-C reaches them all: xargs runs nothing in the background.
printf '%s\n' host others units | xargs -P 3 -I '{}' tools/test_part.sh '{}' "$@" || failed=1
tools/test_part.sh wall_clock "$@" || failed=1
exit $failed
