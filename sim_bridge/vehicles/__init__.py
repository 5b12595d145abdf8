"""Robots without boards: what one is made of, and many worlds with one each (the C of this room)."""
