"""The position board: stones laid out by hand, the best call for them, and playing on.

- `set_up`: a position that was laid out, as a game that goes on from it
- `advice`: the best calls in a position, each with its chances
- `kept_game`: a game as the list of its throws, which is played again to go on
"""
