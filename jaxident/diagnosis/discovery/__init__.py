"""What is predictable and in no catalogue: curves of one signal that windows agree on and judging runs confirm."""
