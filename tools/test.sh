#!/bin/sh
# All tests, after `make` has built what they need. Two rows beside each other, on two cores:
#   the firmware's units on this computer (plain and with sanitizers), then the tests of whole boards and of the tools;
#   the tests of simulator, protocol and documents, then the simulator's under sanitizers.
# Then, alone, those that look at the wall clock. Arguments go to pytest. At the end, a table of what each folder took.
set -eu
cd "$(dirname "$0")/.."
units=build/test-units.log boards=build/test-boards.log
export BOEBOT_TEST_TIMES="$PWD/build/test-times"
rm -f "$BOEBOT_TEST_TIMES"

pytest() { build/venv/bin/python -m pytest "$@"; }

# First row, out of sight: 0, or what failed.
beside() {
  tools/pio test -e native -e native_quad -e native_sanitized >"$units" 2>&1 || return 1
  pytest hil_tests tools --ignore hil_tests/test_served.py "$@" >"$boards" 2>&1 || return 2
}

echo "Beside pytest run the firmware's units, $units, then boards and tools, $boards"
beside "$@" &
row=$!
trap 'trap - INT TERM; kill 0' INT TERM # a job in the background does not hear Ctrl-C

failed=0
pytest sim_bridge protocol docs "$@" || failed=1
tools/test_sanitized.sh || failed=1
first=0
wait $row || first=$?
case $first in
  0) grep "test cases: " "$units"; tail -n 1 "$boards" ;;
  1) tail -n 200 "$units"; echo "the firmware's units failed; all of their output: $units" >&2; failed=1 ;;
  *) tail -n 200 "$boards"; echo "tests of boards or tools failed; all of their output: $boards" >&2; failed=1 ;;
esac
pytest host hil_tests/test_served.py "$@" || failed=1
build/venv/bin/python -m tools.times_table "$BOEBOT_TEST_TIMES" "$units"
exit $failed
