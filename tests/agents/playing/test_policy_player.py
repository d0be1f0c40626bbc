"""A user's policy plays whole games, given observations, its shots and its own memory."""

from __future__ import annotations

import numpy as np
import pytest

from agents.playing.match import play_game
from agents.playing.policy_player import GamePolicy
from agents.playing.trained_player import player_from
from curling_env.errors import InputError
from curling_env.game import GameSimulator, player_named
from curling_env.game.rules import rule_set


class Recurrent:
    """Calls shots, and counts in its memory how many of an end it has called."""

    def __init__(self):
        self.asked = []

    def predict(self, observation, state=None, deterministic=False, action_masks=None):
        assert observation.shape == (180,)
        assert deterministic
        self.asked.append(state)
        return int(np.flatnonzero(action_masks)[0]), 1 if state is None else state + 1


def test_a_policy_of_shots_remembers_each_end_and_forgets_it():
    policy = Recurrent()
    simulator = GameSimulator("standard", rules=rule_set("world_curling_2024", ends=2))
    pair = (GamePolicy(policy), player_named("draw"))
    for _ in range(2):  # the same game again begins without memory
        game = play_game(simulator, pair, seed=3).game
        assert len(game.line_score) >= 2
        ends = len(policy.asked) // 8
        assert policy.asked == ends * [None, *range(1, 8)]
        policy.asked.clear()


def test_a_function_throws_what_its_numbers_mean(monkeypatch):
    """Two teams that throw everything away blank every end, and are level when play stops."""
    monkeypatch.setattr("agents.playing.match.MOST_EXTRA_ENDS", 1)
    simulator = GameSimulator("standard", rules=rule_set("world_curling_2024", ends=1))
    player = GamePolicy(lambda observation: np.float32([1.0, 0.0, 0.0]), "same")
    played = play_game(simulator, (player, player), seed=0)
    assert played.game.line_score == ((0, 0),) * 2
    assert played.game.winner is None
    speeds = {delivery.shot.call.throw.speed for delivery in played.deliveries}
    assert len(speeds) == 1
    with pytest.raises(InputError, match="expected a function of an observation"):
        GamePolicy(3)


def test_a_policy_of_a_module_takes_part_in_a_tournament(curling, tmp_path, monkeypatch):
    (tmp_path / "my_policy.py").write_text(
        "import numpy as np\n\n\ndef same(observation):\n    return np.zeros(3)\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    ran = curling("tournament", "draw", "my_policy:same", "--games", "2", "--ends", "1", "--json")
    assert {one["name"] for one in ran.json()["standings"]} == {"draw", "my_policy:same"}
    assert player_from("my_policy:same").name == "my_policy:same"
