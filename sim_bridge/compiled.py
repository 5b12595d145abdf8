"""The simulator's C, loaded: `sim_bridge._core` (build_core.py)."""

from boebot import missing

ffi, lib = missing.compiled("sim_bridge._core")
