"""A league: generations of a player that meet themselves and their past, and learn from it.

- `settings`: what a league is configured with
- `self_play`: ends played side by side by two networks
- `fit`: a value network fitted to ends that were played
- `run`: the league itself, generation by generation
"""
