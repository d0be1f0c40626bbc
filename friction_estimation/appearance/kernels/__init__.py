"""Compiled code that paints stones and compares them with pictures."""
