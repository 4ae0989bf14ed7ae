"""jaxident."""
