"""Fit of each stone in every frame."""
