#!/bin/sh
# Reads the C parts for this computer with clang, every warning an error. gcc has the same ones, but for conversions,
# where `make soak` builds with sanitizers (setup.py), and for the microcontroller (platformio.ini). The frame code is
# standard C11, for any computer and for the microcontroller.
set -eu
cd "$(dirname "$0")/.."
warnings="-std=gnu11 -O2 -Wall -Wextra -Wno-unused-parameter -Wconversion -Wshadow -Wstrict-prototypes -Wmissing-prototypes -Werror"
lists=$(mktemp -d)
trap 'rm -rf "$lists"' EXIT

# read_with_clang LIST FLAGS...: the files in the list.
read_with_clang() {
  list=$lists/$1
  shift
  xargs -r -P "$(nproc)" -n 20 clang $warnings "$@" -fsyntax-only <"$list"
}

# One pin map; with the argument `all` each. Most files are the same for all, and gcc reads each map's when it builds it.
pin_maps=PIN_MAP_SHIELDBOT
[ "${1:-}" != all ] || pin_maps=$(grep -o 'PIN_MAP_[A-Z0-9_]*' platformio.ini | sort -u)
for pin_map in $pin_maps; do
  find firmware/src -name '*.c' -not -path '*/hal/avr/*' -not -name main.c >"$lists/$pin_map"
  read_with_clang $pin_map -D$pin_map -Ifirmware/src
done

find host -name '*.c' -not -name '_*.c' >"$lists/host"
read_with_clang host -Ihost/boebot/arenas -Ihost/boebot/link -Ifirmware/src
find sim_bridge -name '*.c' -not -name '_*.c' -not -name simavr_machine.c >"$lists/simulator"
read_with_clang simulator -Isim_bridge -Isim_bridge/boards -Isim_bridge/boards/avr/core -Ihost/boebot/arenas -Ifirmware/src

for end in BOARD HOST; do
  for compiler in gcc clang "avr-gcc -mmcu=atmega328p"; do
    $compiler $warnings -std=c11 -Wpedantic -DFRAME_OF_$end -Ifirmware/src -c firmware/src/link/frame.c -o /dev/null
  done
done
