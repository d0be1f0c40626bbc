"""Replay of a recorded game as a film (`film`) or as an animated page (`page`)."""
