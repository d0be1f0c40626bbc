"""Hands from tables of shots: known errors and effects are found again."""

import json

import numpy as np
import pytest

from agents import plan_throw
from agents.playing.match import Match
from agents.playing.search import SearchPlayer
from agents.shots.execution import fit_execution
from agents.shots.grades import GradedShot, _Design, fit_grades, held_out_score
from agents.shots.scatter import GRID, fit_scatter
from agents.shots.table import RULES, Shot, TableEnd, TableGame
from curling_env.errors import InputError
from curling_env.game import GameSimulator
from curling_env.game.rules import RestingStone, Team
from curling_env.game.rules.rulesets import placed_stones
from curling_env.game.skill_file import load_skill
from curling_env.ice import load_ice
from curling_env.throw import Skill
from tests.agents.shots.small_tables import RESTS, SmallTable

PLACED = placed_stones(RULES, RULES.lines(), Team.AWAY)
ICE = load_ice("standard")
HAND = Skill(name="s", sigma_speed=0.02, sigma_angle=0.004, sigma_spin=0.1)


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


# --- execution -----------------------------------------------------------------------------------

TASK = {"draw": "draw", "come-around": "draw", "tap": "raise", "freeze": "freeze",
        "guard": "guard", "cover": "guard", "peel": "takeout"}  # fmt: skip


def played(skill: Skill, games: int) -> list[GradedShot]:
    """Shots of `search` with known hands, by the tasks that a table would give them."""
    simulator = GameSimulator("standard", rules=RULES, skills=skill)
    player = SearchPlayer(60)
    found: list[GradedShot] = []
    for k in range(games):
        for before, one, _ in Match(simulator, (player, player), seed=k):
            end, name = before.game.end, one.call.shot
            assert end is not None
            given = shot(
                4,
                spin=float(np.sign(one.call.throw.spin)),
                task=TASK.get(name, "takeout" if "hit" in name else ""),
                team=end.to_throw,
                number=end.delivered,
                before=end.stones,
                after=one.stones_after,
                player=1 + end.number_of_stone % 2,
            )
            lead, left = before.game.lead(end.hammer), before.game.ends_left
            found.append(GradedShot(shot=given, game=game(k, []), lead=lead, ends_left=left))
    return found


def test_known_errors_are_found_again_though_no_call_is_known(monkeypatch):
    monkeypatch.setattr("agents.shots.execution.FEWEST", 2)
    found = fit_execution(played(HAND, 3), ICE, positions=16)
    assert found.shots > 40
    assert found.line.low < HAND.sigma_angle < 1.2 * found.line.high
    assert found.line.value == pytest.approx(HAND.sigma_angle, rel=0.4)
    assert found.speed.low < 1.2 * HAND.sigma_speed
    assert HAND.sigma_speed < 1.2 * found.speed.high
    assert found.tails > 3  # errors are normal
    tasks = {one.task: one for one in found.tasks}
    assert {"draw", "takeout"} <= set(tasks)
    assert tasks["takeout"].speed is None
    assert tasks["draw"].speed is not None


def first_draws(count: int, left: float) -> list[GradedShot]:
    """First draws around one call, graded by their miss, which is `left` times as large."""
    rng = np.random.default_rng(5)
    found: list[GradedShot] = []
    for k in range(count):
        spin = 1.0 if k % 2 else -1.0
        x, y = 0.3 * (left if spin > 0 else 1.0) * rng.standard_normal(2)
        grade = int(np.clip(5 - np.hypot(x, y) / 0.15, 0, 4))
        after = (*PLACED, RestingStone(Team.HOME, 0, x, y - 1.0))
        found.append(GradedShot(shot=shot(grade, spin=spin, after=after), game=game(k, [])))
    return found


def test_first_draws_show_what_a_grade_is_worth():
    found = fit_execution(first_draws(300, 1.5), ICE, positions=2)
    assert found.by_handle.low < 1.5 < found.by_handle.high
    assert found.by_handle.low > 1.1
    assert found.slope.low > 1.0  # grades fall with the miss
    with pytest.raises(InputError, match="a fit needs 20 or more"):
        fit_execution(first_draws(30, 1.0), ICE, positions=2)


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
    done = curling("hands", path, "-o", tmp_path / "hands", "--positions", 10, "--json")
    document = done.json()
    report = json.loads((tmp_path / "hands" / "report.json").read_text())
    assert {k: v for k, v in report.items() if k != "provenance"} == document
    (draws,) = document["execution"]["tasks"]
    assert (draws["task"], draws["shots"] + draws["unexplained"]) == ("draw", 10)
    assert document["not_separated"]
    skill = load_skill(tmp_path / "hands" / "AAA-7-1.skill.json")
    assert skill.sigma_angle == pytest.approx(
        document["execution"]["line"]["value"] * document["players"][0]["factor"]["value"]
    )
    by_task = load_skill(tmp_path / "hands" / "task-draw.skill.json")
    assert by_task.sigma_angle == document["execution"]["tasks"][0]["line"]["value"]
    found = plan_throw("standard", (0.0, 17.4), skill=load_skill(tmp_path / "hands/all.skill.json"))
    assert found.best is not None
    assert "expected a table of shots" in curling("hands", tmp_path / "Ends.csv").complaint


# --- scatter -------------------------------------------------------------------------------------


def missed(
    scatter: dict[str, float], shots: int = 4000
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Log-likelihoods of misses whose size depends on their owners, and these owners."""
    rng = np.random.default_rng(2)
    owners = {kind: rng.integers(40, size=shots) for kind in scatter}
    size = sum(spread * rng.standard_normal(40)[owners[kind]] for kind, spread in scatter.items())
    miss = np.exp(size) * rng.standard_normal(shots)
    return -GRID - 0.5 * miss[:, None] ** 2 * np.exp(-2 * GRID), owners


def test_scatter_is_found_where_it_is_and_few_shots_say_little():
    curves, owners = missed({"team": 0.3, "player": 0.0})
    found = fit_scatter(curves, owners, np.ones(len(curves)))
    assert found["team"].scatter == pytest.approx(0.3, abs=0.08)
    assert found["player"].scatter < 0.1
    few = fit_scatter(curves[:200], {"team": owners["team"][:200]}, np.ones(200))["team"]
    assert few.variance.min() > 3 * found["team"].variance.max()
    value, precision = found["team"].alone(0)
    assert abs(value) > abs(found["team"].mean[0])  # the mean is shrunk
    assert precision < 1 / found["team"].variance[0]
