"""Stones that move at the same time and collide."""
