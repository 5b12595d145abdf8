#!/bin/sh
# All tests, after `make` has built what they need. Beside each other, on two cores: the firmware's units on this
# computer (plain and with sanitizers), and those of pytest's folders whose tests know only simulated time, followed by
# the simulator's under sanitizers. Then, alone, the folders with tests that look at the wall clock. Arguments go to
# pytest. At the end, a table of what each folder took.
set -eu
cd "$(dirname "$0")/.."
log=build/test-units.log
export BOEBOT_TEST_TIMES="$PWD/build/test-times"
rm -f "$BOEBOT_TEST_TIMES"

pytest() { build/venv/bin/python -m pytest "$@"; }

echo "The firmware's units run beside pytest: $log"
tools/pio test -e native -e native_quad -e native_sanitized >"$log" 2>&1 &
beside=$!
trap 'trap - INT TERM; kill 0' INT TERM # a job in the background does not hear Ctrl-C

simulated=0
pytest sim_bridge protocol docs "$@" || simulated=$?
tools/test_sanitized.sh || simulated=$?
units=0
wait $beside || units=$?
if [ $units -ne 0 ]; then
  tail -n 200 "$log"
  echo "the firmware's units failed; all of their output: $log" >&2
else
  grep "test cases: " "$log"
fi
alone=0
pytest host hil_tests tools "$@" || alone=$?
build/venv/bin/python -m tools.times_table "$BOEBOT_TEST_TIMES" "$log"
[ $simulated -eq 0 ] && [ $units -eq 0 ] && [ $alone -eq 0 ]
