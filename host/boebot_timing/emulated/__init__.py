"""Time as an untouched image keeps it in the emulator: loads at its pins and on its line, and what they show."""
