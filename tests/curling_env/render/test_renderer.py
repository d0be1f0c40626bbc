"""Pictures of the sheet show rings, lines, stones and friction at their places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import FrictionMap, load_ice
from curling_env.physics import Engine, StoneState
from curling_env.render import (
    RED,
    YELLOW,
    DrawnScene,
    DrawnStone,
    SheetRenderer,
    playback_frames,
    scene_at,
)
from curling_env.sheet import PAPER_SHEET, TEE_Y, WORLD_CURLING_SHEET, Direction
from curling_env.throw import Throw


def at(image, renderer, x, y):
    """Return the colour of a point (delivery frame) in the close-up."""
    column, row = np.round(renderer.close_up_pixel((x, y))).astype(int)
    return image[row, column].astype(int)


def near(colour, wanted, by=30):
    return np.abs(np.asarray(colour) - wanted).max() <= by


def uneven():
    mu = np.full(PAPER_SHEET.shape, 0.0082)
    mu[70:, :4] *= 0.9
    mu[70:, 5:] *= 1.1
    observed = np.ones(mu.shape, dtype=bool)
    return replace(
        load_ice("standard"), friction=FrictionMap(mu=mu, sigma=0 * mu, observed=observed)
    )


def test_rings_and_lines_are_painted_where_the_rule_book_puts_them():
    renderer = SheetRenderer(load_ice("standard"))
    image = renderer.draw(DrawnScene())
    blue = at(image, renderer, 1.5, 0.3)
    white = at(image, renderer, 0.9, 0.3)
    red = at(image, renderer, 0.4, 0.3)
    assert blue[2] > blue[0] + 60
    assert white.min() > 230
    assert red[0] > red[2] + 60
    hog = at(image, renderer, 1.5, -6.401 + 0.05)  # painted on the house's side of its edge
    beyond = at(image, renderer, 1.5, -6.401 - 0.05)
    assert hog[0] > hog[1] + 60
    assert beyond.min() > 230


def test_a_stone_is_drawn_with_its_colour_and_its_handle_turns():
    renderer = SheetRenderer(load_ice("standard"))
    stone = DrawnStone(x=-1.0, y=TEE_Y - 3.0, colour=YELLOW)
    image = renderer.draw(DrawnScene(stones=[stone]))
    turned = renderer.draw(DrawnScene(stones=[replace(stone, theta=np.pi / 2)]))
    assert near(at(image, renderer, -1.0 + 0.06, -3.0), YELLOW)
    assert not near(at(turned, renderer, -1.0 + 0.06, -3.0), YELLOW)
    # Heading 0 points along the play, to the right; a quarter turn to the left points up.
    assert not near(at(image, renderer, -1.0, -3.0 + 0.06), YELLOW)
    assert near(at(turned, renderer, -1.0, -3.0 + 0.06), YELLOW)


def test_the_friction_is_a_layer_of_colour():
    renderer = SheetRenderer(uneven())
    image = renderer.draw(DrawnScene())
    keen = at(image, renderer, -1.6, -4.0)
    heavy = at(image, renderer, 1.6, -4.0)
    assert keen[1] > keen[0] + 40
    assert heavy[0] > heavy[2] + 40
    plain = SheetRenderer(load_ice("standard"))
    assert at(plain.draw(DrawnScene()), plain, -1.6, -4.0).min() > 230


def test_both_directions_of_play_run_to_the_right():
    away = SheetRenderer(load_ice("standard"), Direction.AWAY)
    home = SheetRenderer(load_ice("standard"), Direction.HOME)
    path = np.array([[0.0, -11.0], [0.5, 17.0]])
    scene = DrawnScene(
        stones=[DrawnStone(x=0.5, y=17.0)], paths=[(path, RED)], target=np.array([0.2, 17.5])
    )
    turned = DrawnScene(
        stones=[DrawnStone(x=-0.5, y=-17.0)], paths=[(-path, RED)], target=np.array([-0.2, -17.5])
    )
    np.testing.assert_array_equal(away.draw(scene), home.draw(turned))


def test_a_picture_does_not_change_the_next():
    renderer = SheetRenderer(uneven())
    empty = renderer.draw(DrawnScene())
    renderer.draw(
        DrawnScene(stones=[DrawnStone(x=0, y=17)], title="Draw", facts=[("Speed", "2 m/s")])
    )
    np.testing.assert_array_equal(renderer.draw(DrawnScene()), empty)


@pytest.mark.parametrize("sheet", [PAPER_SHEET, WORLD_CURLING_SHEET])
def test_every_sheet_fits_and_stones_beyond_its_edge_do_no_harm(sheet):
    ice = replace(load_ice("standard"), sheet=sheet, friction=FrictionMap.uniform(0.008, sheet))
    image = SheetRenderer(ice).draw(
        DrawnScene(
            stones=[DrawnStone(x=9.0, y=40.0), DrawnStone(x=0, y=-30)], title="μ and σ " * 40
        )
    )
    assert image.shape == (720, 1280, 3)


def test_a_film_shows_the_stone_move_and_leave():
    ice = load_ice("standard")
    before = [StoneState(x=0.0, y=18.8, stone=1)]
    outcome = Engine(ice).play(Throw(speed=2.9).release(stone=100), before, fps=20)
    assert not outcome.status[0].in_play

    def colour(stone):
        return RED if stone == 100 else YELLOW

    start = scene_at(DrawnScene(), before, outcome, 0.0, colour)
    assert [(s.x, s.y) for s in start.stones] == [(0.0, 18.8), (0.0, pytest.approx(-10.9725))]
    middle = scene_at(DrawnScene(), before, outcome, outcome.contacts[0].time / 2, colour)
    assert middle.stones[1].y > -5
    assert len(middle.paths) == 1
    end = scene_at(DrawnScene(), before, outcome, 1e6, colour)
    assert len(end.stones) == len(outcome.in_play)
    assert len(end.paths) == 2
    frames = list(
        playback_frames(SheetRenderer(ice), DrawnScene(), before, outcome, colour, fps=5, speed=4)
    )
    assert len(frames) == np.ceil((outcome.time / 4 + 0.6) * 5) + 1
    assert (frames[0] != frames[3]).any()
