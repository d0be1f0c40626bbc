"""Entries of an ice file that the stone does not feel: errors of the measurement, and remarks."""
