"""What a firmware image says: its ELF file, symbols, source lines and instructions."""
