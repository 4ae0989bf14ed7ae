"""Laws that no catalogue lists: which kinds there are, how poses answer to them, what turns with a wheel."""
