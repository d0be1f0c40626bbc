"""Position board: stones placed by hand, the best call for them, and the game that continues.

- `set_up`: a game that starts from a position placed by hand
- `advice`: the best calls in a position, each with its chances
- `kept_game`: a game as the list of its throws, which is replayed to continue
"""
