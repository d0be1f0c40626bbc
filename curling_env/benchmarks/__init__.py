"""Measures of `curling bench`, and their throws."""
