"""What a run leaves: its record, the same as arrays, figures, and the comparison of two runs."""
