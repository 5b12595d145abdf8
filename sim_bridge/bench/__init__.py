"""A test bench: a board with any image, with or without a robot around it; what tests of firmware are written with."""
