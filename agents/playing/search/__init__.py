"""Player `search`: it chooses the shot that wins the game most often.

- `player`: the search
- `reply`: the value of a position after the opponent's reply
- `evaluator`: the probability of winning from positions
- `shots`, `aiming_table`: candidate shots of a position, as throws on the known ice
- `positions`: throws played into many positions, with rulings
- `value_network`: the score of an end from a position, learned from self-play
- `networks`: the choice of a network for a game
- `win_probability`: the chance to win from score, ends and hammer, backwards from the last end
- `ice_error`: errors of throws because ice and stones differ
- `kernel_regression`: the expected value of a throw, from all simulations near it
- `calling_style`: a team's preferences in addition to the odds
- `tuning`: tuned constants
"""

from agents.playing.search.calling_style import NEUTRAL_STYLE, CallingStyle
from agents.playing.search.player import SearchPlayer, ShotEstimate, throws_before

__all__ = ["NEUTRAL_STYLE", "CallingStyle", "SearchPlayer", "ShotEstimate", "throws_before"]
