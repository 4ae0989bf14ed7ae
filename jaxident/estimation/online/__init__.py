"""Estimators that take one row at a time, on the robot itself."""
