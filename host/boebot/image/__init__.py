"""What a firmware image says: its chip, its flash, symbols and source lines, from its ELF file."""
