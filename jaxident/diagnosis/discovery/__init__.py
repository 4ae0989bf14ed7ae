"""What is predictable and in no catalogue: curves and surfaces that windows agree on and judging runs confirm."""
