"""Good routes fast: the papers' algorithms and the modern local search."""
