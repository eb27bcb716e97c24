"""Lower bounds that scale beyond exact methods."""
