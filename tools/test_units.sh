#!/bin/sh
# The firmware's units: all of them for one pin map, and for two others what only they have; `make soak` has quadrature
# encoders. tools/test_units.sh [OPTION OF pio test...]: with --without-testing they are only built.
exec "$(dirname "$0")/pio" test -e native_sanitized -e native_boebot -e native_line "$@"
