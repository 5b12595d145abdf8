"""The C of arenas and rays, loaded: `boebot.arenas._arena` (build_arena.py)."""

from boebot import missing

ffi, lib = missing.compiled("boebot.arenas._arena")
