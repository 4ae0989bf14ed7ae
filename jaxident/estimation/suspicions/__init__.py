"""What a log says against itself: frames, units, clocks and wheels, each with the option that mends it."""
