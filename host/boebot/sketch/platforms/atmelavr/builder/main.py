"""SCons script of the local platform `atmelavr`: builds an AVR program without a framework and uploads it.

The flags are those that PlatformIO's own platform gives to a project without a framework: both build alike.
"""

from SCons.Script import AlwaysBuild, Builder, Default, DefaultEnvironment

env = DefaultEnvironment()

env.Replace(
    AR="avr-gcc-ar",
    AS="avr-as",
    CC="avr-gcc",
    CXX="avr-g++",
    GDB="avr-gdb",
    LINK="avr-gcc",
    OBJCOPY="avr-objcopy",
    RANLIB="avr-gcc-ranlib",
    SIZETOOL="avr-size",
    ARFLAGS=["rc"],
    SIZEPROGREGEXP=r"^(?:\.text|\.data|\.bootloader)\s+(\d+).*",
    SIZEDATAREGEXP=r"^(?:\.data|\.bss|\.noinit)\s+(\d+).*",
    SIZECHECKCMD="$SIZETOOL -A -d $SOURCES",
    SIZEPRINTCMD="$SIZETOOL -B -d $SOURCES",
    UPLOADER="avrdude",
    UPLOADERFLAGS="-p $BOARD_MCU -c $UPLOAD_PROTOCOL -b $UPLOAD_SPEED -P $UPLOAD_PORT -D",
    UPLOADHEXCMD="$UPLOADER $UPLOADERFLAGS -U flash:w:$SOURCES:i",
    PROGNAME="firmware",
    PROGSUFFIX=".elf",
)

env.Append(
    ASFLAGS=["-mmcu=$BOARD_MCU"],
    ASPPFLAGS=["-x", "assembler-with-cpp"],
    CCFLAGS=["-Os", "-Wall", "-ffunction-sections", "-fdata-sections", "-mmcu=$BOARD_MCU"],
    CXXFLAGS=["-fno-exceptions", "-fno-threadsafe-statics"],
    CPPDEFINES=[("F_CPU", "$BOARD_F_CPU")],
    LINKFLAGS=["-Os", "-mmcu=$BOARD_MCU", "-Wl,--gc-sections", "-Wl,--relax"],
    LIBS=["m"],
    BUILDERS={
        "ElfToHex": Builder(
            action=env.VerboseAction("$OBJCOPY -O ihex -R .eeprom $SOURCES $TARGET", "Building $TARGET"),
            suffix=".hex",
        )
    },
)

elf = env.BuildProgram()
image = env.ElfToHex("$BUILD_DIR/${PROGNAME}", elf)
env.Depends(image, "checkprogsize")

AlwaysBuild(env.Alias("nobuild", image))
AlwaysBuild(env.Alias("buildprog", image, image))
AlwaysBuild(env.Alias("size", elf, env.VerboseAction("$SIZEPRINTCMD", "Calculating size $SOURCE")))
AlwaysBuild(env.Alias("upload", image, env.VerboseAction("$UPLOADHEXCMD", "Uploading $SOURCE")))

Default([image, "checkprogsize"])
