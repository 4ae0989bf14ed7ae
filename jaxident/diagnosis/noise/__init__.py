"""The law of what is random: its shape, its sizes from residuals, and how well these are known."""
