"""The player `search`: it chooses the shot after which the game is won most often.

- `winning`: the chance to win from score, ends and hammer, backwards from the last end
- `worth`: how the end will be scored from a position, learnt from ends it played against itself
- `atlas`, `shots`: the shots a position offers, as throws on the ice as known
- `positions`: throws played into very many positions, and the rules' word on each
- `kernel`: what a throw is worth, from all that was tried near it
- `player`: the search
"""

from agents.playing.search.player import Choice, SearchPlayer

__all__ = ["Choice", "SearchPlayer"]
