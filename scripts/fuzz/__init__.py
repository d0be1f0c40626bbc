"""Mutated and made-up inputs for every command and reader, and what became of them.

`make fuzz` runs it for ten minutes; docs/trust.md has what was found.
"""
