"""How large the gap is, before and after, and where it lies."""
