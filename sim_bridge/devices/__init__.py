"""Simulated devices, one file each under the device's name: what a real one does not do ideally, with sources; what of
it can be switched off; how it is joined to the pins of a board; and its model in a robot without a board.

Their physics is in `world/sensors` and the motors beside it, what their pins do in `parts`.
"""
