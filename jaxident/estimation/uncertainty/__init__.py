"""How sure an estimate is: the Cramér-Rao bound, verdicts per parameter, and what resampling needs."""
