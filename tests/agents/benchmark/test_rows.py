"""Rows are one JSON file each, checked by a command; several trainings have one score."""

from __future__ import annotations

import json

import numpy as np
import pytest

from agents.benchmark import TASKS
from agents.benchmark.rows import aggregate, read_row, scores_of, shortcomings, write_row
from agents.benchmark.scores import score_of
from curling_env.errors import InputError


def row(tmp_path, **changes):
    document = {
        "format": "curling-benchmark/1",
        "version": 1,
        "policy": "ours",
        "scores": [{"task": "guard", "runs": [[0.0, 1.0] * 50] * 5}],
        **changes,
    }
    path = tmp_path / "row.json"
    path.write_text(json.dumps(document))
    return path


def test_several_trainings_count_by_their_interquartile_mean():
    rng = np.random.default_rng(0)
    runs = rng.normal([[0.0], [1.0], [2.0], [3.0], [100.0]], 0.1, (5, 200))
    score = score_of(TASKS["draw"], runs)
    assert score.mean == pytest.approx(2.0, abs=0.05)  # of 1, 2 and 3
    assert (score.runs, score.episodes, score.reward) == (5, 200, None)
    assert score.low < 1.1
    assert score.high > 2.9
    one = score_of(TASKS["draw"], runs[1])
    assert one.high - one.low < 0.1


def test_a_row_is_written_by_the_command_and_read_back(curling, tmp_path):
    path = tmp_path / "row.json"
    asked = ("random", "random", "--task", "guard", "--task", "takeout", "--episodes", "4")
    curling("benchmark", *asked, "-o", path)
    found = read_row(path)
    assert [(one.task, np.shape(one.runs)) for one in found.scores] == [
        ("guard", (2, 4)),
        ("takeout", (2, 4)),
    ]
    assert len(scores_of(found)) == 2
    (result,) = curling("benchmark", path, "--json").json()
    assert result["policy"] == "random"
    assert len(result["shortcomings"]) == 3


def test_what_a_published_row_needs(tmp_path):
    good = row(tmp_path, learnt=True, link="https://example.org/runs")
    assert shortcomings(read_row(good)) == []
    alone = row(tmp_path, learnt=True, scores=[{"task": "guard", "runs": [[0.0, 1.0]]}])
    assert len(shortcomings(read_row(alone))) == 3
    practice = row(tmp_path, scores=[{"task": "end-draw", "runs": [[1.0] * 100]}])
    assert shortcomings(read_row(practice)) == ["no task that counts"]


def test_normalised_scores_are_nothing_for_chance_and_one_for_the_reference(tmp_path):
    low, high = TASKS["end-greedy"].references
    for value in (-5.0, 0.0, 2.0):
        path = row(tmp_path, scores=[{"task": "end-greedy", "runs": [[value] * 100] * 5}])
        assert aggregate(read_row(path))[0] == pytest.approx((value - low) / (high - low))
    low, high = TASKS["draw"].references
    assert low > high > 0  # a distance: less is better


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"version": 0}, "version 0 of the benchmark; this is 1"),
        ({"format": "curling-ice/1"}, "expected a row of the benchmark"),
        (
            {"scores": [{"task": "curl", "runs": [[0.0, 1.0]]}]},
            "unknown task 'curl' of the benchmark",
        ),
        ({"scores": [{"task": "guard", "runs": [[0.0, 0.5]]}]}, "0.5 is no success of an episode"),
        ({"scores": [{"task": "guard", "runs": [[0.0, 1.0], [1.0]]}]}, "runs"),
        ({"scores": [{"task": "end-greedy", "runs": [[9.0, 1.0]]}]}, "9 is no points"),
        ({"scores": [{"task": "guard", "runs": [[0.0, 1.0]]}] * 2}, "lists a task twice"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_a_row_that_cannot_be_is_refused(tmp_path, curling, changes, says):
    with pytest.raises(InputError, match=says):
        read_row(row(tmp_path, **changes))
    assert says in curling("benchmark", row(tmp_path, **changes)).complaint


def test_a_row_keeps_what_it_was_given(tmp_path):
    write_row(tmp_path / "own.json", "own", {"draw": [np.array([0.5, 1.25])]}, method="by hand")
    found = read_row(tmp_path / "own.json")
    assert (found.policy, found.learnt, found.method) == ("own", False, "by hand")
    assert found.scores[0].runs == [[0.5, 1.25]]
