"""A robot as it is built: imperfections and their switches, outline, devices as parts at its board's pins."""
