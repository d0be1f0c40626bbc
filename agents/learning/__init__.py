"""Learning to throw: random ices, training runs, and trained policies in use."""
