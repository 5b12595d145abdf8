#!/bin/sh
# All tests, after `make` has built what they need: tools/test.sh [ARGUMENT OF PYTEST...]
# One part per processor runs at a time, those that take longest first; what a part says is in build/test-PART.log. Then,
# when nothing else computes, the tests that look at the wall clock (pytest's mark wall_clock): each file is a part, four
# at a time, as they mostly wait. At the end, a table of what each folder took.
set -eu
cd "$(dirname "$0")/.."
parts="sanitized tools hil_tests sim_bridge host docs protocol"
export BOEBOT_TEST_TIMES="$PWD/build/test-times"
rm -f "$BOEBOT_TEST_TIMES"

failed=0
echo "Testing, each into build/test-PART.log: $parts"
# Ctrl-C reaches them all: xargs runs nothing in the background.
echo "$parts" | tr ' ' '\n' | xargs -P "$(nproc)" -I '{}' tools/test_part.sh '{}' "$@" || failed=1
echo "Those that look at the wall clock"
grep -rl mark.wall_clock --include='test_*.py' host hil_tests sim_bridge docs | sed 's|.*/test_\(.*\)\.py|wall_clock-\1|' | sort -r |
  xargs -P 4 -I '{}' tools/test_part.sh '{}' "$@" || failed=1
build/venv/bin/python -m tools.times_table "$BOEBOT_TEST_TIMES" build/test-units.log
exit $failed
