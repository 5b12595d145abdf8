#!/bin/sh
# Static analysis of the C parts by cppcheck: the firmware as the microcontroller and as this computer see it, and the
# simulator. A finding that is meant is suppressed at its line, with its reason.
set -eu
cd "$(dirname "$0")/.."
mkdir -p build/cppcheck

analyse() {
  name=$1
  shift
  mkdir -p "build/cppcheck/$name"
  cppcheck --quiet --error-exitcode=1 --inline-suppr --std=c11 --enable=warning,performance,portability \
    --suppress=missingIncludeSystem --cppcheck-build-dir="build/cppcheck/$name" -j "$(nproc)" "$@"
}

analyse avr --platform=avr8 -D__AVR_ATmega328P__ -DF_CPU=16000000L -DPIN_MAP_SHIELDBOT -Ifirmware/src \
  -i firmware/src/hal/native firmware/src
analyse native --platform=unix64 -DPIN_MAP_SHIELDBOT -Ifirmware/src -i firmware/src/hal/avr -i firmware/src/main.c \
  firmware/src
analyse sim_bridge --platform=unix64 -Isim_bridge -Isim_bridge/boards -i sim_bridge/_core.c -i sim_bridge/boards/avr/_avr.c \
  sim_bridge
