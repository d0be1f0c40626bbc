"""A recorded game as a film: every stone at its recorded place and heading, and complete."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest

from agents.playing import deliveries_of, play_game, read_record, write_film, write_record
from agents.playing.replay.film import FPS, HOLD, frames_of
from curling_env.errors import InputError
from curling_env.game import TYPICAL_EVOLUTION, DrawPlayer, GameSimulator, RuleBasedPlayer, rule_set
from curling_env.render import SheetRenderer
from curling_env.sheet import Direction

SPEED = 100.0


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    simulator = GameSimulator(
        rules=rule_set("world_curling_2024", ends=2), ice_evolution=TYPICAL_EVOLUTION, skills="club"
    )
    played = play_game(simulator, (RuleBasedPlayer(), DrawPlayer()), seed=3, paths=True)
    path = tmp_path_factory.mktemp("game") / "game.jsonl"
    write_record(path, played, simulator, ice="standard", seed=3)
    return path, read_record(path), simulator


def nearest(scene, stone):
    """Return the stone of a scene at a recorded place; paths are stored to a millimetre."""
    gap, drawn = min(
        ((np.hypot(s.x - stone["x"], s.y - stone["y"]), s) for s in scene.stones),
        key=lambda pair: pair[0],
    )
    assert gap < 2e-3
    return drawn


def test_frames_show_the_stones_where_the_record_has_them(record, monkeypatch):
    _, lines, simulator = record
    monkeypatch.setattr(SheetRenderer, "draw", lambda self, scene: scene)
    shown = [(number, scene) for number, scene in frames_of(lines, simulator.ice, speed=SPEED)]
    assert {number for number, _ in shown} == set(range(len(lines) - 2))
    headings = {}
    for number, line in enumerate(lines[1:-1]):
        mine = [scene for k, scene in shown if k == number]
        if line["stone"] == 1:
            headings = {}
        for stone in line["before"]:
            # A stone that is struck turns on from the heading it lay at.
            heading = headings.get(stone["stone"], 0.0)
            assert nearest(mine[0], stone).theta == pytest.approx(heading, abs=0.011)
        for stone in line["lying"]:
            headings[stone["stone"]] = nearest(mine[-1], stone).theta
        assert len(mine[-1].stones) == len(line["lying"])
    assert "home" in shown[-1][1].title


def test_an_end_can_be_shown_alone_and_faster(record, monkeypatch):
    monkeypatch.setattr(SheetRenderer, "draw", lambda self, scene: scene)
    _, lines, simulator = record
    slow, fast = (
        sum(1 for _ in frames_of(lines, simulator.ice, ends=[2], speed=speed))
        for speed in (50, 100)
    )
    held = round(HOLD * FPS)
    deliveries = deliveries_of(lines, [2])
    assert {line["end"] for line in deliveries} == {2}
    assert fast > held + len(deliveries)
    time = sum(line["time"] for line in deliveries)
    assert slow - fast == pytest.approx(time / 100 * FPS, abs=len(deliveries))
    with pytest.raises(InputError, match="end 9 was not played"):
        deliveries_of(lines, [9])


def test_the_command_writes_a_film_that_plays(record, curling, monkeypatch, tmp_path):
    path, lines, simulator = record
    film = tmp_path / "end.mp4"
    assert curling("replay", path, "--end", 1, "--speed", 100, "-o", film).status == 0
    capture = cv2.VideoCapture(str(film))
    count = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
    monkeypatch.setattr(SheetRenderer, "draw", lambda self, scene: scene)
    assert count == sum(1 for _ in frames_of(lines, simulator.ice, ends=[1], speed=100))
    _, frame = capture.read()
    assert frame.shape[:2] == SheetRenderer.size[::-1]
    blank = SheetRenderer(simulator.ice, Direction.AWAY)
    assert blank.size == frame.shape[1::-1]
    # OpenCV's films are blue first: the house's outer ring is blue, not red.
    assert (frame[..., 0].astype(int) - frame[..., 2] > 60).sum() > 10_000


def test_the_command_writes_the_page_too(record, curling, tmp_path):
    path, _, _ = record
    page = tmp_path / "game.html"
    assert curling("replay", path, "-o", page).status == 0
    assert "curling-game/1" in page.read_text()


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("-o", "game.gif"), ".mp4"),
        (("-o", "game.mp4", "--end", "7"), "end 7"),
        (("-o", "game.html", "--end", "1"), "whole game"),
        (("-o", "game.mp4", "--ice", "no-such-ice"), "no-such-ice"),
    ],
)
def test_invalid_values_are_refused_and_leave_no_file(
    record, curling, tmp_path, monkeypatch, arguments, word
):
    monkeypatch.chdir(tmp_path)
    result = curling("replay", record[0], *arguments)
    assert result.status == 2
    assert word in result.err
    assert not list(tmp_path.iterdir())


def test_a_record_without_a_path_is_refused_with_its_place(record, tmp_path):
    _, lines, simulator = record
    broken = json.loads(json.dumps(lines))
    broken[1]["paths"] = []
    with pytest.raises(InputError, match="end 1, stone 1"):
        write_film(tmp_path / "film.mp4", broken, simulator.ice, speed=SPEED)
    assert not list(tmp_path.iterdir())
