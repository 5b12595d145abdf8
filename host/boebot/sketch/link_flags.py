"""PlatformIO, before the link: the linker gets the compiler's options, for it compiles what is optimised as a whole.

It also writes the debugging information then. Of a user's program that names the user's folder for that of a copy; and
nothing is relaxed, as with Arduino's own tools, for that spoils the addresses of lines (binutils 2.26).
"""

import json
import os

from SCons.Script import Import

Import("env")
env = globals()["env"]

env.AppendUnique(LINKFLAGS=[flag for flag in env["CCFLAGS"] if str(flag).startswith(("-f", "-g", "-m", "-n"))])
if "BOEBOT_FOLDERS" in os.environ:
    env.Append(LINKFLAGS=[f"-fdebug-prefix-map={pair}" for pair in json.loads(os.environ["BOEBOT_FOLDERS"])])
    env.Replace(LINKFLAGS=[flag for flag in env["LINKFLAGS"] if flag != "-Wl,--relax"])
