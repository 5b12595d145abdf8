"""Timing budgets: what the firmware may take, what it can take at most, and whether both fit (notes, section 3.2).

Bounds come from `avr_timing`, which analyses the machine code; measurements come from elsewhere as
`measured.Measurement`.
"""
