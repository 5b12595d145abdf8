"""The serial link: frames, transports, session and the generated messages."""
