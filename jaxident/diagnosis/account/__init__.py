"""How large the gap is before and after, who causes how many millimetres of it, and where it lies."""
