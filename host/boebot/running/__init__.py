"""From "run this brain" to the last step: requests, drivers, guarded steps, Ctrl-C, several robots."""
