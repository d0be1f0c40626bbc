"""Hands from tables of shots: known errors and effects are found again."""

import json

import numpy as np
import pytest

from agents import plan_throw
from agents.playing.search.aiming_table import AimingTable
from agents.shots import hits
from agents.shots.grades import GradedShot, _Design, fit_grades, held_out_score
from agents.shots.inversion import Inversion
from agents.shots.openings import fit_openings
from agents.shots.table import RULES, Shot, TableEnd, TableGame
from curling_env.errors import InputError
from curling_env.game.rules import RestingStone, Team
from curling_env.game.rules.rulesets import placed_stones
from curling_env.game.skill_file import load_skill
from curling_env.ice import load_ice
from curling_env.sheet import Direction
from curling_env.throw import Skill
from tests.agents.shots.small_tables import RESTS, SmallTable

PLACED = placed_stones(RULES, RULES.lines(), Team.AWAY)
ICE = load_ice("standard")


def game(number: int, shots: list[Shot], teams: tuple[int, int] = (1, 2)) -> TableGame:
    """A game whose ends have one of the shots each."""
    ends = tuple(
        TableEnd(
            number=k,
            hammer=Team.AWAY,
            power_play=None,
            score=(0, 0),
            counted=0,
            short_by=0.0,
            shots=(shot,),
            stopped=False,
            row=2,
        )
        for k, shot in enumerate(shots)
    )
    return TableGame(
        key=(1, 1, number), names=("AAA", "BBB"), teams=teams, result=(0, 0), ends=ends
    )


def shot(
    grade: int, *, spin: float = 1.0, task: str = "draw", team: Team = Team.HOME, **more
) -> Shot:
    """A first delivery among the placed stones."""
    given = {"before": PLACED, "after": PLACED, "number": 0, "player": 1, "row": 2, **more}
    return Shot(team=team, task=task, spin=spin, grade=grade, **given)


# --- openings ------------------------------------------------------------------------------------


def openings(count: int, sigma_speed: float, sigma_line: float) -> list[TableGame]:
    """Openings around one call with normal errors, graded by their miss."""
    rng = np.random.default_rng(5)
    table = AimingTable(ICE, Direction.AWAY)
    reach = 27.0  # how much farther a stone goes per speed, about [m / (m/s)]
    shots: list[Shot] = []
    for k in range(count):
        spin = 1.0 if k % 2 else -1.0
        x = float(sigma_line * 28.35 * rng.standard_normal())
        y = -0.5 + float(sigma_speed * reach * rng.standard_normal())
        grade = int(np.clip(5 - np.hypot(x, y + 0.5) / 0.15, 0, 4))
        stone = RestingStone(Team.HOME, 0, x, min(y, 0.0))
        after = (*PLACED, stone)
        if y > 0.0:  # it pushed the stone in the house
            house = PLACED[1]
            after = (PLACED[0], house._replace(y=house.y + 0.2), stone)
        shots.append(shot(grade, spin=spin, after=after))
    assert table.button_speed > 2
    return [game(k, shots[k::10]) for k in range(10)]


def test_known_errors_of_openings_are_found_again():
    found = fit_openings(openings(400, 0.010, 0.003), ICE, resamples=8)
    assert found.struck > 10
    assert found.speed.low < 0.011
    assert found.speed.high > 0.0093
    assert found.line.value == pytest.approx(0.003, rel=0.12)
    assert found.line.low < 0.003 < found.line.high * 1.05
    assert found.tails > 6
    assert found.by_handle.low < 1.0 < found.by_handle.high
    assert found.slope.low > 1.0  # grades fall with the miss


def test_too_few_openings_are_refused():
    with pytest.raises(InputError, match="a fit needs 20 or more"):
        fit_openings(openings(10, 0.01, 0.003), ICE)


# --- hits ----------------------------------------------------------------------------------------


def test_the_factor_is_the_one_with_which_as_many_hits_are_made():
    skill = Skill(name="s", sigma_speed=0.03, sigma_angle=0.006, sigma_spin=0.1)
    target = RestingStone(Team.AWAY, 0, 0.4, 0.3)
    before = (target,)
    takeout = {"number": 4, "before": before, "task": "takeout"}
    one = GradedShot(shot=shot(4, **takeout), game=game(0, []))
    inversion = Inversion(ICE)
    rng = np.random.default_rng(1)
    rates = np.mean([hits._rates(one, 1, inversion, skill, rng) for _ in range(6)], axis=0)
    assert rates[0] > 0.95
    assert (np.diff(rates) < 0.05).all()
    assert rates[-1] < 0.8
    made = round(200 * float(rates[hits.FACTORS == 1.4][0]))
    shots = [
        GradedShot(
            shot=shot(4 if k < made else 0, after=() if k < made else before, **takeout),
            game=one.game,
        )
        for k in range(200)
    ]
    (found,) = hits.fit_hits(shots, ICE, skill, positions=10)
    assert found.task == "takeout"
    assert found.made == pytest.approx(made / 200)
    assert found.factor.low < 1.4 < found.factor.high
    assert found.line == pytest.approx(found.factor.value * 0.006)


# --- grades --------------------------------------------------------------------------------------


def graded(effect: float, games: int = 40) -> list[TableGame]:
    """Games between teams of which the even ones are better by an effect on the logit."""
    rng = np.random.default_rng(3)
    thresholds = np.array([-2.5, -2.0, -1.2, -0.2])
    found: list[TableGame] = []
    for k in range(games):
        teams = 2 * int(rng.integers(5)), 2 * int(rng.integers(5)) + 1
        shots: list[Shot] = []
        for n in range(40):
            team = Team(n % 2)
            ability = effect if team is Team.HOME else -effect
            grade = int((rng.logistic() + ability > thresholds).sum())
            task = "draw" if rng.random() < 0.7 else "guard"
            shots.append(shot(grade, task=task, team=team, player=1 + n % 4 // 2))
        found.append(game(k, shots, teams))
    return found


def test_the_gradient_of_the_loss_is_right():
    from agents.shots.grades import KINDS, graded_shots

    design = _Design(graded_shots(graded(0.5, 4)))
    rng = np.random.default_rng(0)
    scatter = np.full(len(KINDS), 0.3)
    at = design.start() + 0.1 * rng.standard_normal(len(design.start()))
    loss, gradient = design._loss(at, scatter)
    for k in range(0, len(at), 3):
        step = np.zeros(len(at))
        step[k] = 1e-6
        assert gradient[k] == pytest.approx(
            (design._loss(at + step, scatter)[0] - loss) / 1e-6, abs=2e-3
        )


def test_teams_that_differ_are_distinguished_and_predict_other_games():
    games = graded(0.6)
    held = held_out_score(games)
    assert held.gain > 4 * held.stderr > 0
    assert held.log_score == pytest.approx(held.baseline + held.gain)
    from agents.shots.grades import graded_shots

    model = fit_grades(graded_shots(games))
    ability = {
        team: effect.value + model.effects["player"][1, team, 1].value
        for team, effect in model.effects["team"].items()
    }
    assert min(v for k, v in ability.items() if k % 2 == 0) > 0.2
    assert max(v for k, v in ability.items() if k % 2) < -0.2
    chances = model.probabilities(graded_shots(games)[0])
    assert chances.sum() == pytest.approx(1.0)
    assert (chances > 0).all()


def test_teams_that_do_not_differ_are_shrunk_and_gain_nothing():
    games = graded(0.0)
    held = held_out_score(games)
    assert abs(held.gain) < 3 * held.stderr + 0.002
    from agents.shots.grades import graded_shots

    model = fit_grades(graded_shots(games))
    assert max(abs(effect.value) for effect in model.effects["team"].values()) < 0.15


# --- the command ---------------------------------------------------------------------------------


def test_the_command_writes_a_report_and_skills_that_other_commands_take(tmp_path, curling):
    small = SmallTable()
    rng = np.random.default_rng(2)
    for _ in range(45):
        first = (750 + int(rng.normal(0, 20)), 900 + int(rng.normal(0, 70)))
        small.end((first, *RESTS[1:]), (0, 2))
    path = small.write(tmp_path)
    done = curling("hands", path, "-o", tmp_path / "hands", "--json")
    document = done.json()
    report = json.loads((tmp_path / "hands" / "report.json").read_text())
    assert {k: v for k, v in report.items() if k != "provenance"} == document
    assert document["openings"]["shots"] == 45
    assert document["not_separated"]
    skill = load_skill(tmp_path / "hands" / "AAA-7-1.skill.json")
    assert skill.sigma_angle == pytest.approx(
        document["openings"]["line"]["value"] * document["players"][0]["factor"]["value"]
    )
    found = plan_throw("standard", (0.0, 17.4), skill=load_skill(tmp_path / "hands/all.skill.json"))
    assert found.best is not None
    assert "expected a table of shots" in curling("hands", tmp_path / "Ends.csv").complaint
