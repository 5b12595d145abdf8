#!/bin/sh
# Static analysis of the C parts by cppcheck: the firmware by `pio check`, as the microcontroller sees it (in `make soak`
# as this computer does, too), then the simulator and the host library. A finding that is meant is suppressed at its line,
# with its reason.
set -eu
cd "$(dirname "$0")/.."
mkdir -p build/cppcheck

tools/pio check -e shieldbot --fail-on-defect low --fail-on-defect medium --fail-on-defect high
cppcheck --quiet --error-exitcode=1 --inline-suppr --std=c11 --enable=warning,performance,portability \
  --suppress=missingIncludeSystem --cppcheck-build-dir=build/cppcheck -j "$(nproc)" \
  --platform=unix64 -Isim_bridge -Isim_bridge/boards -Ihost/boebot/arenas -Ihost/boebot/link -Ifirmware/src \
  -i sim_bridge/_core.c -i sim_bridge/boards/avr/_avr.c sim_bridge host
