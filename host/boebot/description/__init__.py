"""What a robot is, as files: reading and checking of `protocol/robots/*.toml`, errors with file, line and key."""
