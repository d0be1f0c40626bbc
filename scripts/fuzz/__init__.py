"""Mutated and invented inputs for every command and reader, and their results.

`make fuzz` runs it for ten minutes; docs/trust.md lists the findings.
"""
