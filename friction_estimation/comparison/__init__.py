"""Measured throws beside those that an estimated ice predicts."""
