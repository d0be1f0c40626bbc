"""Evidence for a term: significance, held-out throws, intervals, rivals, the unknown."""
