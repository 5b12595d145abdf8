"""PlatformIO, before the build: an upload names its port. PlatformIO would take any serial port it finds."""

import sys

from SCons.Script import COMMAND_LINE_TARGETS, Import

Import("env")
env = globals()["env"]

if "upload" in COMMAND_LINE_TARGETS and not env.subst("$UPLOAD_PORT"):
    sys.stderr.write("Error: name the robot's serial port: --upload-port /dev/ttyACM0 (or COM3, ...)\n")
    env.Exit(1)
