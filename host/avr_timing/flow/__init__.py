"""Instructions and how control flows: functions as graphs, their jumps, loops, known values and longest walks."""
