"""Ends played by known hands, held against the ends of championships.

- `play`: games of `search` against itself under given conditions, one record for each
- `grades`: the grade of a shot, 0 to 4
- `published`: how ends of championships were scored, and how a sample compares
"""
