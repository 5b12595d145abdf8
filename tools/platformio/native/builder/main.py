"""SCons script of the local platform `native`: builds a program for this computer."""

from SCons.Script import AlwaysBuild, Default, DefaultEnvironment

env = DefaultEnvironment()

program = env.BuildProgram()
execute = env.VerboseAction("$SOURCE $PROGRAM_ARGS", "Executing $SOURCE")

AlwaysBuild(env.Alias("buildprog", program, program))
AlwaysBuild(env.Alias("exec", program, execute))
AlwaysBuild(env.Alias("size", program, env.VerboseAction("size -B -d $SOURCE", "Calculating size $SOURCE")))

Default([program])
