"""Measures of `curling bench`, and the throws that they make."""
