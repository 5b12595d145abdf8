"""What a run leaves: what was put aside while it went on, the same as arrays, its figures, the comparison of two."""
