"""What a function takes at most: cycles and bytes of the stack, interrupts not counted."""
