"""Where programs meet a served robot: a pseudo-terminal or a TCP port of loopback, for one client at a time."""
