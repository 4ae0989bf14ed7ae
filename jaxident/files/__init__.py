"""What is read from files and written to them: logs, streams and models."""
