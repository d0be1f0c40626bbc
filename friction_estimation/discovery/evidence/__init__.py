"""Whether a term is real: significance, held-out throws, intervals, rivals, the unknown."""
