"""The kit's own tests of a board: what PROTOCOL.md promises, for any board that speaks the protocol (`boebot test`)."""
