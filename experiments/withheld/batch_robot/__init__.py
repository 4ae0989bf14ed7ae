"""A simulator of its own in plain NumPy, many runs at once; no code of the package."""
