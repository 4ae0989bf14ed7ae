"""Many trials: the paper's experiment and synthetic logs."""
