#!/bin/sh
# Prints our own C and C++ sources: what is formatted and analysed. Generated files and tests' programs made by builds
# are not among them.
cd "$(dirname "$0")/.."
find firmware sim_bridge \( -name '*.[ch]' -o -name '*.cpp' \) -not -path '*/generated/*' | sort
