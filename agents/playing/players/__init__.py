"""Players that look ahead without learning; the simpler ones are in `curling_env.game.opponents`.

- `greedy`: the best of its list of shots, one delivery ahead
- `heuristic`: the value of a position by a rule of thumb
"""
