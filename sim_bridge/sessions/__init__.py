"""Simulated robots as the host opens them: with a board or without, one or several in a world."""
