"""Which effect: scores, full refits, sets of several, what shows without a refit and what none explains."""
