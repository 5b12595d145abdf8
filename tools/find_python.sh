#!/bin/sh
# Prints a Python that can make our virtual environment: 3.11 or newer, with venv, pip and the C headers.
# Looks at $PYTHON first. Prints nothing and fails where there is none.
set -u
usable='
import importlib.util, os, sys, sysconfig
sys.exit(not (sys.version_info >= (3, 11)
              and all(importlib.util.find_spec(name) for name in ("venv", "ensurepip"))
              and os.path.exists(os.path.join(sysconfig.get_paths()["include"], "Python.h"))))
'
for name in ${PYTHON:-} python3 python3.14 python3.13 python3.12 python3.11 /usr/bin/python3; do
  python=$(command -v "$name") || continue
  if "$python" -c "$usable" 2>/dev/null; then
    echo "$python"
    exit 0
  fi
done
exit 1
