"""The player `search`: it chooses the shot after which it wins the game most often.

- `player`: the search
- `reply`: what a position is worth once the opponent has replied
- `evaluator`: the probability of winning from positions
- `shots`, `aiming_table`: the shots that a position offers, as throws on the known ice
- `positions`: throws played into very many positions, and ruled on
- `value_network`: how an end is scored from a position, learnt from ends of self-play
- `networks`: which network values which games
- `win_probability`: the chance to win from score, ends and hammer, backwards from the last end
- `ice_error`: how far throws may go otherwise, because ice and stones differ
- `kernel_regression`: the expected value of a throw, from all simulations near it
- `calling_style`: what a team calls for beside the odds
- `tuning`: the constants that were tuned
"""

from agents.playing.search.calling_style import BY_THE_ODDS, CallingStyle
from agents.playing.search.player import SearchPlayer, ShotEstimate, throws_before

__all__ = ["BY_THE_ODDS", "CallingStyle", "SearchPlayer", "ShotEstimate", "throws_before"]
