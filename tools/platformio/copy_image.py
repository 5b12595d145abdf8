"""PlatformIO, after the build: copies the image to build/images/<pin map>.elf and .hex."""

from SCons.Script import Copy, Default, Import

Import("env")
env = globals()["env"]

for suffix in (".elf", ".hex"):
    built = "$BUILD_DIR/${PROGNAME}" + suffix
    copied = "$PROJECT_DIR/build/images/${PIOENV}" + suffix
    Default(env.Command(copied, built, env.VerboseAction(Copy("$TARGET", "$SOURCE"), "Copying $TARGET")))
