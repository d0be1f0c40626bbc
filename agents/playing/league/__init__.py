"""League: generations of a player that learn by playing themselves and earlier generations.

- `settings`: configuration of a league
- `self_play`: ends played in parallel by two networks
- `fit`: a value network fitted to played ends
- `run`: the league itself, generation by generation
"""
