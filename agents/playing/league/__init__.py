"""Generations of a player that meets its past, and what positions it has learnt to be worth."""
