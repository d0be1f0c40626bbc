"""Figures of the coaching results."""
