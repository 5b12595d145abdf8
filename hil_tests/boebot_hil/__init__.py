"""The kit's own tests of a board: what PROTOCOL.md promises, for any board that speaks the protocol (`boebot test`)."""

from boebot.guests import Command

COMMAND = Command(
    "Prove a board, emulated or at a port: what the protocol promises, one test each.", "sim_bridge.bench.command:test"
)
