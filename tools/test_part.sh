#!/bin/sh
# One part of all tests: tools/test_part.sh PART [ARGUMENT OF PYTEST...]. PART is a folder, `units` (the firmware's on this
# computer, plain and with sanitizers) or `sanitized` (tools/test_sanitized.sh). Says how it ended; more only if it failed.
set -eu
cd "$(dirname "$0")/.."
part=$1
shift
log=build/test-$part.log

run() {
  case $part in
    units) tools/pio test -e native -e native_quad -e native_sanitized ;;
    sanitized) tools/test_sanitized.sh ;;
    *) build/venv/bin/python -m pytest "$part" -m "not wall_clock" "$@" ;;
  esac
}

if run "$@" >"$log" 2>&1; then
  echo "$part: $(grep -E ' test cases: | passed| no tests ran' "$log" | tail -n 1 | tr -d '=' | sed 's/^ *//; s/ *$//')"
else
  tail -n 200 "$log"
  echo "$part failed; all of its output: $log" >&2
  exit 1
fi
