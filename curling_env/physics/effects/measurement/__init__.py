"""Entries of an ice file that do not act on the stone: errors of the measurement, and remarks."""
