"""The figures that the kit promises, measured: `make bench`.

One module per kind; a figure is a function that is marked with `figure` and returns the measured number.
"""
