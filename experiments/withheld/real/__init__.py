"""Logs of real robots, what their diagnoses came out as, and looks at the logs without any model."""
