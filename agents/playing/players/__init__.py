"""Players that need no learning.

- `aiming`: from a shot in the sport's words to a throw on the known ice
- `draw`, `rulebased`, `greedy`: the players
- `heuristic`: the value of a position by a rule of thumb
"""
