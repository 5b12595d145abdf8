#!/bin/sh
# One part of all tests: tools/test_part.sh PART [ARGUMENT OF PYTEST...]. PART is a folder, wall_clock-NAME, those tests
# of test_NAME.py that look at the wall clock, or `sanitized` (tools/test_sanitized.sh). Before those of `tools` run the
# firmware's units on this computer, those of the usual pin map with sanitizers: both use PlatformIO, which has one
# folder. Says how the part ended; more only if it failed.
set -eu
cd "$(dirname "$0")/.."
part=$1
shift
log=build/test-$part.log units=build/test-units.log

of_wall_clock() {
  build/venv/bin/python -m pytest "$(find host hil_tests sim_bridge docs -name "test_${part#wall_clock-}.py")" -m wall_clock "$@"
}

of_folder() { build/venv/bin/python -m pytest "$part" -m "not wall_clock and not soak" "$@"; }

# Those of the simulator run under sanitizers; here are the rest, and those with random input, which get more of it.
of_simulator() {
  build/venv/bin/python -m pytest "$part" -m "(unsanitized or hypothesis) and not wall_clock and not soak" "$@"
}

run() {
  case $part in
    sanitized) tools/test_sanitized.sh ;;
    tools)
      # all environments of tests but `native`, which is `native_sanitized` without sanitizers
      tools/pio test $(sed -n 's/^\[env:\(native_.*\)\]$/-e \1/p' platformio.ini) >"$units" 2>&1 ||
        { cat "$units" && return 1; }
      grep ' test cases: ' "$units" && of_folder "$@"
      ;;
    wall_clock-*) of_wall_clock "$@" ;;
    sim_bridge) of_simulator "$@" ;;
    *) of_folder "$@" ;;
  esac
}

if run "$@" >"$log" 2>&1; then
  grep -E ' test cases: | passed' "$log" | tr -d '=' | sed "s/^ */$part: /"
else
  tail -n 200 "$log"
  echo "$part failed; all of its output: $log" >&2
  exit 1
fi
