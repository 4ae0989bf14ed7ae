"""The paper's way: increments of path and heading, their regressors, and fits that are linear in them."""
