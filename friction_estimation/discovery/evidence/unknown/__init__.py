"""Effects that the catalogue lacks: the variables that they follow, and their size."""
