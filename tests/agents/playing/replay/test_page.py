"""The replay page in a real browser shows the record."""

from __future__ import annotations

import json

import numpy as np
import pytest

from agents.playing import lines_of, play_game, write_page
from curling_env.game import TYPICAL_EVOLUTION, DrawPlayer, GameSimulator, RuleBasedPlayer, rule_set
from curling_env.sheet import TEE_Y

HOME, AWAY = (206, 38, 50), (244, 190, 32)
"""Handles of the two teams, RGB."""


@pytest.fixture(scope="module")
def game(tmp_path_factory):
    simulator = GameSimulator(
        rules=rule_set("world_curling_2024", ends=2),
        ice_evolution=TYPICAL_EVOLUTION,
        skills="club",
        sweeping=True,
    )
    played = play_game(simulator, (RuleBasedPlayer(), DrawPlayer()), seed=3, paths=True)
    lines = lines_of(played, simulator, ice="standard", seed=3)
    # A name is shown, never run.
    lines[0]["home"] = "<b>Anna & co</b></script>"
    path = tmp_path_factory.mktemp("page") / "game.html"
    write_page(path, lines)
    return path.as_uri(), json.loads(json.dumps(lines))


@pytest.fixture
def opened(page, game):
    page.goto(game[0])
    page.click("#play")  # it plays from the beginning: stop it
    return page, game[1]


def scrub(page, place: float) -> None:
    """Drag the slider to a place, in stones of the game."""
    page.eval_on_selector(
        "#place",
        "(bar, to) => { bar.value = to; bar.dispatchEvent(new Event('input')); }",
        place,
    )


def colours_at(page, places, direction: int) -> np.ndarray:
    """Return colours of the picture of the house a third of a radius beside points of the sheet,
    RGB.
    """
    # Beside the middle, where the handle's bar is not, in four directions: one is free of it.
    return np.array(
        page.evaluate(
            """([places, d]) => places.map(([x, y]) => [[1, 0], [0, 1], [-1, 0], [0, -1]].map(
                 ([a, b]) => {
                   const [u, w] = house.place(x + 0.05 * a, y + 0.05 * b, d);
                   return [...house.ink.getImageData(u, w, 1, 1).data.slice(0, 3)];
                 }))""",
            [places, direction],
        )
    )


def pictured(page) -> str:
    return page.eval_on_selector("#house", "canvas => canvas.toDataURL()")


def test_every_stone_is_at_its_recorded_place_in_its_teams_colour(opened):
    page, lines = opened
    throws = lines[1:-1]
    looked_at = 0
    for number in range(0, len(throws), 5):
        scrub(page, number + 0.998)
        line = throws[number]
        direction = 1 if line["direction"] == "away" else -1
        stones = [s for s in line["lying"] if abs(abs(s["y"]) - TEE_Y) < 1.8]
        if not stones:
            continue
        seen = colours_at(page, [[s["x"], s["y"]] for s in stones], direction)
        for stone, around in zip(stones, seen, strict=True):
            wanted = HOME if stone["team"] == "home" else AWAY
            assert np.abs(around - wanted).max(axis=1).min() <= 8
            looked_at += 1
    assert looked_at >= 5


def test_the_board_shows_the_score_as_it_stood(opened):
    page, lines = opened
    result, throws = lines[-1], lines[1:-1]
    assert page.inner_text(".name >> nth=0") == lines[0]["home"]
    assert page.locator("b").count() == 0
    scrub(page, 0.0)
    assert page.locator(".total").all_inner_texts() == ["0", "0"]
    scrub(page, len(throws))
    assert page.locator(".total").all_inner_texts() == [str(n) for n in result["score"]]
    for team in (0, 1):
        cells = page.locator(f"tbody tr:nth-child({team + 1}) td[data-end]").all_inner_texts()
        assert cells == [str(end[team]) for end in result["line_score"]]
    assert page.locator(".hammer.has").count() == 1
    assert page.locator(".left i.gone").count() == 16
    facts = page.inner_text("#facts")
    winner = result["winner"]
    assert ("tie" if winner is None else f"({winner}) wins") in facts


def test_scrubbing_and_keys_move_the_stones(opened):
    page, lines = opened
    scrub(page, 4.2)
    early = pictured(page)
    scrub(page, 4.999)
    late = pictured(page)
    assert early != late
    scrub(page, 4.2)
    assert pictured(page) == early
    page.press("body", "ArrowRight")
    assert page.inner_text("#facts dd >> nth=1") == "6 of 16"
    page.press("body", "ArrowLeft")
    assert page.inner_text("#facts dd >> nth=1") == "5 of 16"
    page.click("thead th[data-end='2']")
    assert page.inner_text("#facts dd >> nth=0") == "2"
    draw = next(k for k, line in enumerate(lines[1:-1]) if line["shot"] == "draw")
    scrub(page, draw + 0.99)
    split = next(t for t in page.locator("#facts dd").all_inner_texts() if t.endswith(" s"))
    assert 9.0 < float(split.removesuffix(" s")) < 20.0


def test_it_plays_automatically_and_freezes_when_stopped(opened):
    page, _ = opened
    scrub(page, 2.0)
    before = float(page.input_value("#place"))
    page.click("#play")
    page.wait_for_function(
        "before => Number(document.getElementById('place').value) > before", arg=2.2
    )
    page.click("#play")
    stopped = page.input_value("#place")
    picture = pictured(page)
    page.wait_for_timeout(300)
    assert float(stopped) > before
    assert page.input_value("#place") == stopped
    assert pictured(page) == picture


def test_it_fits_a_telephone(opened):
    page, _ = opened
    page.set_viewport_size({"width": 390, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
