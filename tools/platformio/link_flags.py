"""PlatformIO, before the link: the linker gets the compiler's options, for it compiles what is optimised as a whole."""

from SCons.Script import Import

Import("env")
env = globals()["env"]

env.AppendUnique(LINKFLAGS=[flag for flag in env["CCFLAGS"] if str(flag).startswith(("-f", "-g", "-m"))])
