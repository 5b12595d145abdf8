#!/bin/sh
# All tests, after `make` has built what they need. Beside each other, on two cores: the firmware's units on this
# computer (plain and with sanitizers) with the simulator's sanitizers, and those of pytest's folders whose tests know
# only simulated time. Then, alone, the folders with tests that look at the wall clock. Arguments go to pytest.
set -eu
cd "$(dirname "$0")/.."
log=build/test-units.log

units() {
  tools/pio test -e native -e native_quad -e native_sanitized
  tools/test_sanitized.sh
}

pytest() { build/venv/bin/python -m pytest "$@"; }

echo "Firmware units and sanitizers run beside pytest: $log"
units >"$log" 2>&1 &
beside=$!
trap 'trap - INT TERM; kill 0' INT TERM # a job in the background does not hear Ctrl-C

simulated=0
pytest sim_bridge protocol docs "$@" || simulated=$?
units=0
wait $beside || units=$?
if [ $units -ne 0 ]; then
  tail -n 200 "$log"
  echo "firmware units or sanitizers failed; all of their output: $log" >&2
else
  grep -hE "test cases: |[0-9]+ passed" "$log" || true
fi
pytest host hil_tests tools "$@"
[ $simulated -eq 0 ] && [ $units -eq 0 ]
