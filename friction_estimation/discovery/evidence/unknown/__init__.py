"""Effects outside the catalogue: the variables that they follow, and their size."""
