"""Cases: what is drawn, how it is sealed, how it is diagnosed."""
