"""Timing budgets: what an image may take, what it can take at most, and whether both fit (notes, section 3.2).

Everything in here reads an ELF file and what the ELF says of itself; nothing in here runs it. Measurements come from
elsewhere as `measured.Measurement`.
"""
