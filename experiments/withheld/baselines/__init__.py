"""Simpler ways to name an effect, scored by the same table."""
