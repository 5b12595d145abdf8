#!/bin/sh
# Makes sure that the tools which are not Python packages are there: tools/setup_system.sh run|test|check|bench|soak ...
# On Debian and Ubuntu it installs what is missing, by package name, as root or with a sudo that asks nothing; otherwise
# it prints the one command to type. Does nothing where nothing is missing.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
missing=

# need PACKAGE COMMAND...: the package is missing unless the command succeeds.
need() {
  package=$1
  shift
  "$@" >/dev/null 2>&1 || missing="$missing $package"
}

has() { command -v "$1"; }

has_browser() { has chromium || has chromium-browser || has google-chrome; }

# clang with the libraries of its fuzzer and sanitizers, which Debian keeps in a separate package
can_fuzz() {
  echo 'int LLVMFuzzerTestOneInput(void) { return 0; }' | clang -fsanitize=fuzzer,address,undefined -x c -o /dev/null -
}

for purpose in "$@"; do
  case $purpose in
    run)
      need build-essential has cc
      need "python3 python3-venv python3-dev" "$here/find_python.sh"
      need gcc-avr has avr-gcc
      need binutils-avr has avr-objcopy
      need avr-libc sh -c 'echo "#include <avr/io.h>" | avr-gcc -mmcu=atmega328p -E -'
      need arduino-core-avr test -e /usr/share/arduino/hardware/arduino/avr/platform.txt
      need ca-certificates test -e /etc/ssl/certs/ca-certificates.crt
      ;;
    test)
      need doctest-dev sh -c 'echo "#include <doctest/doctest.h>" | c++ -x c++ -E -'
      need avrdude has avrdude
      need gdb-avr has avr-gdb
      need chromium has_browser
      need "clang libclang-rt-dev" can_fuzz
      need build-essential has c++
      ;;
    check)
      need clang has clang
      need cppcheck has cppcheck
      ;;
    bench)
      need "libsimavr-dev libelf-dev" test -e /usr/include/simavr/sim_avr.h
      ;;
    soak)
      need qemu-system-misc has qemu-system-avr
      need qemu-user has qemu-aarch64
      need "wine wine64" has wine
      ;;
    *)
      echo "setup_system.sh: unknown purpose '$purpose'; known: run test check bench soak" >&2
      exit 2
      ;;
  esac
done

[ -n "$missing" ] || exit 0
missing=$(echo "$missing" | tr ' ' '\n' | sort -u | tr '\n' ' ' | sed 's/^ *//; s/ *$//')

if ! command -v apt-get >/dev/null 2>&1; then
  echo "Please install what these Debian packages hold, then try again: $missing" >&2
  exit 1
fi
if [ "$(id -u)" = 0 ]; then
  as_root=
elif command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null; then
  as_root="sudo -n"
else
  echo "Some tools are missing. Please type this, then try again:" >&2
  echo "  sudo apt-get update && sudo apt-get install -y $missing" >&2
  exit 1
fi
echo "Installing: $missing"
export DEBIAN_FRONTEND=noninteractive
log=$here/../build/apt.log
mkdir -p "$here/../build"
{ $as_root apt-get update && $as_root apt-get install -y --no-install-recommends $missing; } >"$log" 2>&1 || {
  tail -n 20 "$log" >&2
  echo "apt-get could not install what is missing (all of its output: build/apt.log)" >&2
  exit 1
}
