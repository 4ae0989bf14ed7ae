"""The fit of the nominal robot with some effects, start states free, and the first one that a search begins from."""
