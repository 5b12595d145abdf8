#!/bin/sh
# Prints our own C and C++ sources: what is formatted and analysed. Generated files are not among them.
cd "$(dirname "$0")/.."
find firmware host sim_bridge tools \( -name '*.[ch]' -o -name '*.cpp' \) -not -path '*/generated/*' -not -name '_*.c' | sort
