"""From logs to models: observations, regressors, start values, the recursion, prediction."""
