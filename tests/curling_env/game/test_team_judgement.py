"""Teams' reading of the ice and of their stones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.game import PERFECT_JUDGEMENT, Call, GameSimulator, Team, TeamJudgement, sweep_for
from curling_env.ice import load_ice
from curling_env.sheet import Direction
from curling_env.throw import Throw

ICE = load_ice("standard")
DRAW = Throw(speed=2.09, angle=-0.045, spin=1.5)


def curl_of(ice):
    effect = ice.effect("curl")
    assert effect is not None
    return effect.parameters["strength"]


def test_teams_that_are_never_wrong_read_the_known_ice_itself():
    simulator = GameSimulator(ICE, sweeping=True)
    state = simulator.begin_end(simulator.new_game(1))
    assert simulator.view(state).ice is simulator.known_ice
    assert PERFECT_JUDGEMENT.ice_as_read(ICE, 1, Team.HOME, 0) is ICE
    assert PERFECT_JUDGEMENT.sweepers_error(1, 0) == 0.0


def test_each_team_reads_the_ice_again_in_every_end_with_the_given_spread():
    judgement = TeamJudgement(weight=0.02, curl=0.1)
    read = [
        judgement.ice_as_read(ICE, seed, team, end)
        for seed in range(100)
        for team in Team
        for end in range(2)
    ]
    weight = np.log([ice.friction.mu[0, 0] / ICE.friction.mu[0, 0] for ice in read])
    curl = np.log([curl_of(ice) / curl_of(ICE) for ice in read])
    assert len(set(weight.tolist())) == len(weight)
    assert weight.std() == pytest.approx(0.02, rel=0.12)
    assert curl.std() == pytest.approx(0.1, rel=0.12)
    assert abs(np.corrcoef(weight, curl)[0, 1]) < 0.2
    again = judgement.ice_as_read(ICE, 0, Team.HOME, 0)
    assert again.friction.mu[0, 0] == read[0].friction.mu[0, 0]


def test_a_game_shows_each_team_its_own_reading_and_plays_on_the_true_ice():
    wrong = GameSimulator(ICE, judgement=TeamJudgement(weight=0.05))
    state = wrong.begin_end(wrong.new_game(3))
    home, away = (wrong.view(state, team).ice for team in Team)
    assert home is wrong.view(state, Team.HOME).ice
    assert home.friction.mu[0, 0] != away.friction.mu[0, 0] != ICE.friction.mu[0, 0]
    right = GameSimulator(ICE)
    places = [
        simulator.play(simulator.begin_end(simulator.new_game(3)), Call(throw=DRAW))[1].stones_after
        for simulator in (wrong, right)
    ]
    assert places[0] == places[1]


def test_sweepers_sweep_for_the_ice_of_the_call_and_as_they_misjudge():
    light = replace(DRAW, speed=DRAW.speed - 0.03)
    right = sweep_for(ICE, DRAW, light, Direction.AWAY)
    assert sweep_for(ICE, DRAW, light, Direction.AWAY, read=ICE) == right
    keen = replace(ICE, friction=replace(ICE.friction, mu=0.98 * ICE.friction.mu))
    longer = sweep_for(ICE, DRAW, light, Direction.AWAY, read=keen)
    shorter = sweep_for(ICE, DRAW, light, Direction.AWAY, misjudged=0.4)
    assert longer[1] > right[1] > shorter[1]
    assert sweep_for(ICE, DRAW, light, Direction.AWAY, misjudged=3.0) == (0.0, 0.0)


def test_the_spread_of_the_sweepers_expectation():
    judgement = TeamJudgement(sweep=0.5)
    errors = [judgement.sweepers_error(seed, throw) for seed in range(20) for throw in range(20)]
    assert np.std(errors) == pytest.approx(0.5, rel=0.12)
    assert abs(np.mean(errors)) < 0.1


@pytest.mark.parametrize("given", [{"weight": -0.1}, {"curl": 0.9}, {"sweep": float("nan")}])
def test_judgements_that_no_team_has_are_refused(given):
    with pytest.raises(InputError, match="must be (within|between)"):
        TeamJudgement(**given)
