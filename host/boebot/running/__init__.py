"""From "run this brain" to the last step: what is asked for, the drivers, guarded steps, Ctrl-C, several robots."""
