"""A game joins rules and physics: execution error, wear, and whole games of random throws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.game import (
    NO_EVOLUTION,
    TYPICAL_EVOLUTION,
    Call,
    GameSimulator,
    IceEvolution,
    Team,
)
from curling_env.sheet import HACK_Y
from curling_env.throw import FROM_HACK, SKILLS, Throw

DRAW = Throw(speed=2.09, angle=-0.045, spin=1.5)


def begun(simulator: GameSimulator, seed: int = 0):
    return simulator.begin_end(simulator.new_game(seed))


def random_call(rng: np.random.Generator) -> Call:
    return Call(
        throw=Throw(
            speed=float(rng.uniform(1.7, 3.5)),
            angle=float(rng.uniform(-0.08, 0.08)),
            spin=float(rng.uniform(-2, 2)),
        )
    )


def test_execution_errors_belong_to_the_state():
    simulator = GameSimulator(skills="club")
    state = begun(simulator)
    call = Call(throw=DRAW)
    first, again = simulator.play(state, call)[1], simulator.play(state, call)[1]
    other = simulator.play(replace(state, seed=1), call)[1]
    assert first.thrown == again.thrown != DRAW
    assert other.thrown != first.thrown


def test_errors_have_the_spread_of_the_skill():
    simulator = GameSimulator(skills="club")
    state = begun(simulator)
    skill = simulator.skills[0]
    slips = np.array(
        [
            [t.speed - DRAW.speed, t.angle - DRAW.angle, t.spin - DRAW.spin]
            for t in (
                simulator.with_execution_error(DRAW, skill, replace(state, seed=s))
                for s in range(800)
            )
        ]
    )
    sigma = [skill.sigma_speed, skill.sigma_angle, skill.sigma_spin]
    assert slips.std(axis=0) == pytest.approx(sigma, rel=0.12)
    assert np.abs(slips.mean(axis=0) / sigma).max() < 0.15


def test_ice_wears_where_stones_ran_and_nowhere_else():
    simulator = GameSimulator(ice_evolution=IceEvolution(wear=-0.01))
    state = begun(simulator)
    for _ in range(4):
        state, _ = simulator.play(state, Call(throw=DRAW))
    assert state.wear is not None
    assert not state.wear.flags.writeable
    sheet = simulator.ice.sheet
    row, column = sheet.cell_of([[0.3, 0.0]])
    assert 4 * -0.01 * 0.25 * 1.01 < state.wear[row[0], column[0]] < 4 * -0.01 * 0.25 * 0.5
    assert state.wear[:20].max() == state.wear[:20].min() == 0.0  # behind the delivery hog line
    assert simulator.current_ice(state).friction.mu.min() < simulator.ice.friction.mu.min()


def test_worn_ice_carries_a_stone_farther_and_frosted_ice_less_far():
    rests = {}
    for name, evolution in (
        ("still", NO_EVOLUTION),
        ("worn", IceEvolution(wear=-0.05)),
        ("frosted", IceEvolution(frost=1.0)),
    ):
        simulator = GameSimulator(ice_evolution=evolution)
        state = begun(simulator)
        for _ in range(6):
            state, shot = simulator.play(state, Call(throw=Throw(speed=2.6, angle=-0.03, spin=1.5)))
        _, shot = simulator.play(state, Call(throw=Throw(speed=1.9, angle=-0.03, spin=1.5)))
        rests[name] = shot.outcome.stones[-1].y
    assert rests["worn"] > rests["still"] + 0.2 > rests["frosted"] + 0.4


@pytest.mark.parametrize("rules", ["world_curling_2024", "mixed_doubles_2024", "digital_curling"])
def test_whole_games_of_random_throws(rules):
    """No stone overlaps another, every number is finite, and energy is never gained."""
    rng = np.random.default_rng(8)
    simulator = GameSimulator(
        rules=rules, ice_evolution=TYPICAL_EVOLUTION, sweeping=True, skills="club"
    )
    for seed in range(3):
        state = simulator.new_game(seed, last_stone=Team(seed % 2))
        while not state.game.is_over and len(state.game.line_score) < 12:
            state = simulator.begin_end(state)
            while state.game.end is not None:
                state, shot = simulator.play(state, random_call(rng), paths=True)
                check(simulator, shot)
        for home, away in state.game.line_score:
            assert min(home, away) == 0
            assert max(home, away) <= simulator.rules.stones + simulator.rules.placed_stones


def check(simulator: GameSimulator, shot) -> None:
    places = np.array([(s.x, s.y) for s in shot.stones_after]).reshape(-1, 2)
    assert np.isfinite(places).all()
    if len(places) > 1:
        apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
        apart[np.diag_indices(len(places))] = np.inf
        assert apart.min() > 2 * simulator.ice.stone.radius - 1e-3
    for stone in shot.stones_after:
        assert simulator.lines.on_sheet(stone.x, stone.y)
    # No stone is ever faster than the stone that was thrown.
    for path in shot.outcome.trajectories:
        steps = np.diff(path.t)
        speeds = np.hypot(*np.diff(path.xy, axis=0).T)[steps > 1e-3] / steps[steps > 1e-3]
        assert speeds.max(initial=0.0) <= shot.thrown.speed + 1e-6


def test_a_game_may_be_thrown_from_the_hack():
    simulator = GameSimulator("fcv1", delivery=FROM_HACK)
    state = begun(simulator)
    assert simulator.view(state).delivery is FROM_HACK
    fast = Call(throw=Throw(speed=5.0, spin=1.5))
    shot = simulator.play(state, fast, paths=True)[1]
    assert shot.outcome.trajectories[0].xy[0] == pytest.approx([0.0, -HACK_Y])
    assert shot.thrown.speed == FROM_HACK.max_speed  # what is meant has a greatest speed


def test_an_error_may_make_a_throw_faster_than_its_greatest_speed():
    simulator = GameSimulator("fcv1", delivery=FROM_HACK, skills="club")
    fast = Throw(speed=4.0, spin=1.5)
    states = [begun(simulator, seed) for seed in range(20)]
    speeds = [simulator.with_execution_error(fast, simulator.skills[0], s).speed for s in states]
    assert max(speeds) > 4.0


def test_every_stone_has_a_thrower():
    none, club = SKILLS["none"], SKILLS["club"]
    exact, lead_scatters = (none,) * 8, (club, club, *(none,) * 6)
    simulator = GameSimulator(throwers=(lead_scatters, exact))
    state, thrown = begun(simulator), []
    for _ in range(6):
        view = simulator.view(state)
        state, shot = simulator.play(state, Call(throw=DRAW))
        thrown.append((shot.team, view.skill.name, shot.thrown == DRAW))
    ours, theirs = Team.HOME, Team.AWAY
    assert thrown == [
        *[(ours, "club", False), (theirs, "none", True)] * 2,
        *[(ours, "none", True), (theirs, "none", True)],
    ]
    with pytest.raises(InputError, match="a thrower for each of 8 stones"):
        GameSimulator(throwers=(exact, exact[:5]))
