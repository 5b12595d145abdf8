#!/bin/sh
# One part of all tests (tools/test.sh): tools/test_part.sh host|others|units|wall_clock [ARGUMENT OF PYTEST...].
# Says how it ended, and what each folder's tests took; more only if it failed.
set -eu
cd "$(dirname "$0")/.."
part=$1
shift
log=build/test-$part.log

# Python's tests in those folders. Each process reads all files that it is given, so there are two halves with a process
# each, and with more only where there are more than three processors.
python() {
  processes=$(($(nproc) / 2))
  [ "$processes" -gt 1 ] || processes=0
  build/venv/bin/python -m pytest -n "$processes" --dist loadfile -m "not wall_clock and not soak" "$@"
}

run() {
  case $part in
    host) python host/tests host/boebot_campaign host/boebot_can host/boebot_course "$@" ;;
    others) python docs host/avr_timing host/boebot_timing tools hil_tests sim_bridge protocol "$@" ;;
    # All units for one pin map, and for two others what only they have. Quadrature encoders: sim_bridge/tests/firmware,
    # and `make soak`.
    # A unit that waits for what does not come would do it for ever.
    units) timeout 1200 tools/pio test -e native_sanitized -e native_boebot -e native_line ;;
    # Each of the four reads all files of tests that it is given, so it is given those that have such tests.
    wall_clock)
      build/venv/bin/python -m pytest -n 4 --dist loadfile -m "wall_clock and not soak" \
        $(grep -rl --include='test_*.py' 'mark.wall_clock' docs hil_tests host protocol sim_bridge tools) "$@"
      ;;
  esac
}

if run "$@" >"$log" 2>&1; then
  grep -E ' test cases: | passed|^time of ' "$log" | tr -d '=' | sed "s/^ */$part: /"
else
  tail -n 200 "$log"
  echo "$part failed; all of its output: $log" >&2
  exit 1
fi
