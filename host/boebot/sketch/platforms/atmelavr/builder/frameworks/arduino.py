"""SCons script of the framework `arduino`: its core and libraries, with the flags that Arduino's own tools give."""

from pathlib import Path

from SCons.Script import DefaultEnvironment

env = DefaultEnvironment()
board = env.BoardConfig()
folder = Path(env.PioPlatform().get_package_dir("framework-arduino-avr"))
core = folder / "cores" / "arduino"
variant = folder / "variants" / board.get("build.variant")

env.Append(
    CCFLAGS=["-flto"],
    CFLAGS=["-std=gnu11"],
    CXXFLAGS=["-std=gnu++11", "-fpermissive", "-Wno-error=narrowing"],
    # float.h of avr-gcc 5 gives DECIMAL_DIG, which the core needs, to C alone
    CPPDEFINES=[
        *("ARDUINO_ARCH_AVR", f"ARDUINO_{board.get('build.board')}"),
        *(("ARDUINO", 10808), ("DECIMAL_DIG", "__DECIMAL_DIG__")),
    ],
    CPPPATH=[str(core), str(variant)],
    LINKFLAGS=["-flto", "-fuse-linker-plugin"],
    LIBSOURCE_DIRS=[str(folder / "libraries")],
)
env.Prepend(LIBS=[env.BuildLibrary(str(Path("$BUILD_DIR") / "FrameworkArduino"), str(core))])
