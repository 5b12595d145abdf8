"""What interrupts wait for, and what work takes when they come on top of it."""
