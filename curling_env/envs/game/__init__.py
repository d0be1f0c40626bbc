"""Environments of a game: one end against an opponent, and the two-team game."""
