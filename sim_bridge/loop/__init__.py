"""Boards and world in lockstep (the C of this room), and a simulation as bytes."""
