#!/bin/sh
# Compiles the C parts for this computer with gcc and with clang, every warning an error. The microcontroller's build
# has the same warnings in platformio.ini. The frame code is standard C11, for any computer and for the microcontroller.
set -eu
cd "$(dirname "$0")/.."
warnings="-std=gnu11 -O2 -Wall -Wextra -Wconversion -Wshadow -Wstrict-prototypes -Wmissing-prototypes -Werror"
simavr=$(find build/simavr -name sim_avr.h -exec dirname {} \; 2>/dev/null | sed 's|/sim$||' | head -n 1)

# compile COMPILER FLAGS...: compiles the files named on standard input
compile() {
  xargs -P "$(nproc)" -I{} "$@" $warnings -c {} -o /dev/null
}

for compiler in gcc clang; do
  for pin_map in SHIELDBOT SHIELDBOT_BASIC SHIELDBOT_QUAD SHIELDBOT_LINE BOEBOT; do
    find firmware/src -name '*.c' -not -path '*/hal/avr/*' -not -name main.c |
      compile $compiler -DPIN_MAP_$pin_map -Ifirmware/src
  done
  find host -name '*.c' -not -name '_*.c' | compile $compiler -Ihost/boebot/arenas -Ihost/boebot/link -Ifirmware/src
  find sim_bridge -name '*.c' -not -name '_*.c' -not -path '*/avr/*' | compile $compiler -Isim_bridge -Isim_bridge/boards -Ihost/boebot/arenas -Ifirmware/src
  if [ -n "$simavr" ]; then
    find sim_bridge -name '*.c' -not -name '_*.c' -path '*/avr/*' |
      compile $compiler -Isim_bridge -Isim_bridge/boards -Ihost/boebot/arenas -isystem "$simavr/sim" -isystem "$simavr/cores"
  fi
done

for end in BOARD HOST; do
  for compiler in gcc clang "avr-gcc -mmcu=atmega328p"; do
    $compiler $warnings -std=c11 -Wpedantic -DFRAME_OF_$end -Ifirmware/src -c firmware/src/link/frame.c -o /dev/null
  done
done
