"""PlatformIO, before the build: makes the headers of firmware/src/generated, by PlatformIO's own Python alone."""

import subprocess

from SCons.Script import Import

Import("env")
env = globals()["env"]

if subprocess.run([env.subst("$PYTHONEXE"), env.subst("$PROJECT_DIR/protocol/generate.py")]).returncode:
    env.Exit(1)
