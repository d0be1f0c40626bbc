"""Measured paths: free slides, wrong rows, several cameras, tables of other programs."""
