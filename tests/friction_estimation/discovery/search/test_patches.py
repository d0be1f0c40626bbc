"""The rectangle of other friction that promises most, its cells, and the places of its sides."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.sheet import PAPER_SHEET
from friction_estimation.discovery import (
    Term,
    base_model,
    find_patches,
    fit_with_noise,
    open_session,
    refit,
    score_candidates,
    standard_errors,
)
from friction_estimation.discovery.evidence.intervals import with_sides
from friction_estimation.discovery.model.candidates import known_effects
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.search import patches
from friction_estimation.discovery.search.patches import (
    SideScan,
    _best_rectangle,
    grid_over,
    place_sides,
    scan_side,
    sides_along,
)

from ..conftest import effect

PATCH = {"x_min": -0.4, "x_max": 0.6, "y_min": -4.0, "y_max": 6.0}


def test_no_rectangle_nearby_promises_more(make_session):
    """The score test of a patch says so, which knows nothing of the cells."""
    sides = {"x_min": -0.6, "x_max": 0.4, "y_min": -4.0, "y_max": 1.0}
    session = open_session(make_session([effect("friction_patch", **sides, factor=1.1)], throws=8))
    fitted = fit_with_noise(base_model(None, session), session)
    (found,) = find_patches(fitted)
    for side, place in sides.items():
        assert found.values[side] == pytest.approx(place, abs=0.4 if side[0] == "x" else 1.1)

    def gain(patch):
        return score_candidates(fitted, [patch])[0].gain

    best = gain(found)
    for side, place in sides.items():
        for step in (-2, -1, 1, 2):
            moved = found.values[side] + step * (0.25 if side[0] == "x" else 1.0)
            assert gain(found.with_values(**{side: moved})) < 1.02 * best, (side, place, step)


def test_no_rectangle_is_tried_that_could_not_be_named(make_session):
    session = open_session(make_session(throws=8))
    assert find_patches(fit_with_noise(base_model(None, session), session)) == []


def test_a_cell_holds_the_points_between_its_sides(rng):
    xy = rng.uniform([-1.0, -15.0], [1.5, 18.0], (200, 2))
    grid = grid_over(xy, (0.25, 1.0))
    assert grid.size == (0.25, 1.0)
    cells = grid.cells_of(xy)
    assert 0 <= cells.min() <= cells.max() < np.prod(grid.shape)
    column, row = np.divmod(cells, grid.shape[1])
    sides = [
        grid.rectangle((i, i + 1, j, j + 1), PAPER_SHEET) for i, j in zip(column, row, strict=True)
    ]
    for (x, y), (left, right, near, far) in zip(xy, sides, strict=True):
        assert left <= x <= right
        assert near <= y <= far
    # The outermost points lie in the outermost cells, even on the side of one.
    corners = np.array([[-1.0, 2.0], [-1.0, 5.0], [1.0, 2.0], [1.0, 5.0]])
    grid = grid_over(corners, (0.25, 1.0))
    assert grid.shape == (8, 3)
    assert grid.cells_of(corners).tolist() == [0, 2, 21, 23]
    assert grid_over(np.array([[0.3, -10.0], [0.3, 10.0]]), (0.25, 1.0)).shape == (1, 20)


def test_a_rectangle_goes_on_beside_the_outermost_stones_and_ends_with_the_sheet():
    grid = grid_over(np.array([[-1.0, -30.0], [1.0, 5.0]]), (0.25, 1.0))
    assert grid.rectangle((0, 2, 30, 35), PAPER_SHEET) == (-1.5, -0.5, 0.0, 5.0)
    assert grid.rectangle((2, 8, 0, 10), PAPER_SHEET) == (-0.5, 1.5, -22.25, -20.0)
    assert grid.rectangle((2, 8, 0, 7), PAPER_SHEET) is None


@pytest.fixture
def off_to_the_right(make_session):
    """A fit whose patch begins 0.3 m too far right."""
    tracks = make_session([effect("friction_patch", **PATCH, factor=0.9)], throws=14)
    session = open_session(tracks)
    plain = fit_with_noise(base_model(None, session), session)
    card = known_effects(session.measurements)["friction_patch"]
    values = {**PATCH, "x_min": -0.1, "factor": 0.95}
    term = Term(card=card, values=values, free=("factor",))
    return refit(plain, plain.model.with_terms(term))


def test_what_a_place_would_bring_is_foreseen(off_to_the_right) -> None:
    label, values = "friction_patch", off_to_the_right.model.term("friction_patch").values
    scan = scan_side(off_to_the_right, label, "x_min")
    assert (np.diff(scan.shifts) > 0).all()
    widths = values["x_max"] - values["x_min"] - scan.shifts
    assert widths.min() >= 0.125  # no patch is narrower than a running band, let alone inside out
    assert values["x_min"] + scan.shifts.min() >= -PAPER_SHEET.width / 2
    fitted: list[float] = []
    for shift in scan.shifts:
        moved = off_to_the_right.model.term(label).with_values(x_min=values["x_min"] + shift)
        model = off_to_the_right.model.without(label).with_terms(moved)
        fitted.append(refit(off_to_the_right, model).deviance)
    best = int(np.argmin(fitted))
    assert int(np.argmin(scan.deviances)) == best
    assert values["x_min"] + scan.shifts[best] == pytest.approx(-0.4, abs=0.05)
    # Where a place is better, the gain is foreseen within a third of it.
    gain = off_to_the_right.deviance - fitted[best]
    assert gain > 100
    assert off_to_the_right.deviance - scan.deviances[best] == pytest.approx(gain, rel=0.33)


def test_a_side_goes_where_it_fits(off_to_the_right) -> None:
    placed = place_sides(off_to_the_right)
    term = placed.model.term("friction_patch")
    assert sides_along(placed.model) == [(term.label, "x_min"), (term.label, "x_max")]
    assert term.values["x_min"] == pytest.approx(-0.4, abs=0.15)
    assert term.values["factor"] == pytest.approx(0.9, abs=0.01)
    # What is not known of the sides makes the rest less sure too.
    plain = standard_errors(placed)
    sigma = with_sides(placed, plain)
    for side in ("x_min", "x_max"):
        assert 0.05 <= sigma["friction_patch", side] < 0.5
        assert abs(term.values[side] - PATCH[side]) < 3 * sigma["friction_patch", side]
    strength = "friction_patch", "factor"
    assert plain[strength] <= sigma[strength] < 4 * plain[strength]
    assert abs(term.values["factor"] - 0.9) < 3 * sigma[strength]


def gains_of_blocks(information, right_side, longest):
    """Gain of every block of cells, one after the other."""
    nx, ny = right_side.shape
    gains = {}
    for i0 in range(nx):
        for i1 in range(i0 + 1, nx + 1):
            for j0 in range(ny):
                for j1 in range(j0 + 1, min(ny, j0 + longest) + 1):
                    chosen = np.zeros((nx, ny))
                    chosen[i0:i1, j0:j1] = 1.0
                    felt = np.einsum("ij,ijkl,kl->", chosen, information, chosen)
                    slope = (chosen * right_side).sum()
                    gains[i0, i1, j0, j1] = slope**2 / felt if felt > 1e-6 else 0.0
    return gains


@pytest.mark.parametrize("longest", [1, 3, 6])
def test_the_best_rectangle_is_that_of_a_search_through_all(rng, longest):
    for _ in range(5):
        columns = rng.normal(size=(30, 4, 5))
        columns[:, :, 2] *= rng.random(4) < 0.5
        information = np.einsum("nij,nkl->ijkl", columns, columns)
        right_side = np.einsum("nij,n->ij", columns, 3.0 * rng.normal(size=30))
        gains = gains_of_blocks(information, right_side, longest)
        best = _best_rectangle(information, right_side, longest)
        assert best is not None
        assert gains[best] == pytest.approx(max(gains.values()))
        assert max(gains.values()) > 16.0


def test_a_rectangle_below_the_gain_of_an_effect_is_none():
    information = np.eye(6).reshape(3, 2, 3, 2)
    right_side = np.zeros((3, 2))
    right_side[1, 1] = 3.9
    assert _best_rectangle(information, right_side, 2) is None
    right_side[1, 1] = 4.1
    assert _best_rectangle(information, right_side, 2) == (1, 2, 1, 2)


def test_a_rectangle_extends_to_the_left_where_no_stone_ran():
    """And not where stones ran without it."""
    information = np.zeros((4, 1, 4, 1))
    for column in (0, 3):
        information[column, 0, column, 0] = 1.0
    right_side = np.array([[0.1], [0.0], [0.0], [9.0]])
    assert _best_rectangle(information, right_side, 1) == (1, 4, 0, 1)


# --- choices of sides and effects, with deviances that are given ---------------------------------


@dataclass(frozen=True)
class Given:
    """A fit of which the model and the deviance are known."""

    model: Model
    deviance: float
    session: Any = None


def patched(free: tuple[str, ...] = ("factor",)) -> Given:
    card = known_effects()["friction_patch"]
    term = Term(card=card, values={**PATCH, "factor": 1.1, "edge": 0.1}, free=free)
    ice: Any = SimpleNamespace(sheet=PAPER_SHEET)
    return Given(Model(ice=ice, terms=(term,)), 700.0)


@pytest.mark.parametrize(("deviance", "moved"), [(698.9, True), (699.1, False)])
def test_a_side_is_moved_to_the_best_place_if_that_fits_better_by_one(monkeypatch, deviance, moved):
    shifts, none = np.array([-0.3, 0.0, 0.2]), np.zeros((3, 1))
    scans = {
        "x_min": SideScan(shifts, np.array([650.0, 700.0, 690.0]), none),
        "x_max": SideScan(shifts, np.array([710.0, 700.0, 705.0]), none),
    }
    monkeypatch.setattr(patches, "scan_side", lambda _, __, side: scans[side])
    monkeypatch.setattr(
        patches,
        "refit",
        lambda fitted, model, *, iterations: replace(fitted, model=model, deviance=deviance),
    )
    placed: Any = place_sides(patched())
    values = placed.model.terms[0].values
    assert values["x_min"] == pytest.approx(PATCH["x_min"] - (0.3 if moved else 0.0))
    assert values["x_max"] == PATCH["x_max"]
    assert values["y_min"] == PATCH["y_min"]
    # A side that is fitted is placed by the fit.
    assert sides_along(patched(("factor", "x_min")).model) == [("friction_patch", "x_max")]


def test_patches_are_searched_once_where_places_are_seen(monkeypatch):
    rectangle = (-0.5, 0.5, 1.0, 4.0)
    asked = []

    def find(_, grid):
        asked.append(grid)
        return rectangle

    monkeypatch.setattr(patches, "find_rectangle", find)
    xy = np.array([[-0.6, -9.0], [0.6, 9.0], [50.0, 90.0]])
    ice: Any = SimpleNamespace(sheet=PAPER_SHEET)
    session = SimpleNamespace(gates=None, measurements=(), xy=xy)
    bare: Any = Given(Model(ice=ice), 700.0, session)
    (found,) = find_patches(bare)
    assert [found.values[side] for side in ("x_min", "x_max", "y_min", "y_max")] == [*rectangle]
    assert found.free == found.card.first
    for name, value in found.card.neutral.items():
        assert found.values[name] == value
    # A place off the sheet, of a wild track, does not widen the grid; cells are 0.25 m by 1 m.
    (grid,) = asked
    assert grid.low == (-0.6, -9.0)
    assert grid.size == (0.25, 1.0)
    across = int(np.ceil((PAPER_SHEET.width / 2 + 0.6) / 0.25))
    assert grid.shape == (across, int(np.ceil(PAPER_SHEET.length / 2 + 9.0)))
    assert find_patches(replace(patched(), session=session)) == []
    session.gates = SimpleNamespace()
    assert find_patches(bare) == []
    session.gates = None
    monkeypatch.setattr(patches, "find_rectangle", lambda *_: None)
    assert find_patches(bare) == []
