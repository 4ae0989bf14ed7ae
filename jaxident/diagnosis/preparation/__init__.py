"""From logs to what a search works on: scaled commands, windows, the part of each run, bad poses, lost commands."""
