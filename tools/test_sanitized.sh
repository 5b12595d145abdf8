#!/bin/sh
# The simulator's tests with all C built under the address and undefined-behaviour sanitizers: `make fuzz`, `make soak`.
# Builds a second copy of the packages under build/sanitized.
set -eu
cd "$(dirname "$0")/.."
python=build/venv/bin/python

# Python's files anew: one that has gone from the sources must not stay.
[ ! -d build/sanitized/lib ] || find build/sanitized/lib -type f -not -name '*.so' -delete
BOEBOT_SANITIZE=1 $python setup.py --quiet build --build-base build/sanitized --build-lib build/sanitized/lib \
  >build/sanitized.log 2>&1 || { cat build/sanitized.log; exit 1; }

# What a run gives must not depend on how the C was compiled: the usual build leaves its bits for the other to compare.
export BOEBOT_STATE_FILE="$PWD/build/state-bits"
rm -f "$BOEBOT_STATE_FILE"
$python -m pytest -q sim_bridge/tests/loop/test_run.py -k however_it_was_compiled
test -s "$BOEBOT_STATE_FILE"

# The tests go beside the libraries that they are to test, and both are looked for there first; with their compiled
# modules, as compiling takes long under sanitizers.
rm -rf build/sanitized/lib/sim_bridge/tests
cp -Rp sim_bridge/tests build/sanitized/lib/sim_bridge/tests
$python -m compileall -q -x /tests/ build/sanitized/lib

asan=$(cc -print-file-name=libasan.so)
ubsan=$(cc -print-file-name=libubsan.so)
# Python itself leaves memory to the end of the process. Its own small objects are watched only where it takes each of them
# from malloc, which is slow: `make soak` sets PYTHONMALLOC=malloc.
# A report names the four innermost calls that allocated: more of them, noted at each of Python's allocations, take long.
# Left out: what is marked so (pyproject.toml), and waits for the wall clock.
echo "Simulator under sanitizers"
root=$PWD
cd build/sanitized/lib
LD_PRELOAD="$asan $ubsan" ASAN_OPTIONS=detect_leaks=0:malloc_context_size=4 BOEBOT_SANITIZED=1 \
  "$root/$python" -m pytest -q -c "$root/pyproject.toml" --rootdir "$PWD" \
  -o pythonpath="$PWD $root $root/host/tests" sim_bridge/tests \
  -m "not unsanitized and not soak and not wall_clock"
