"""The data that the figures of a discovery show."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.state import State
from curling_env.sheet import HOG_LINE_Y, TEE_Y
from curling_env.units import Units
from friction_estimation.reports import discovery_figures as module

MU, G = 0.009, 9.80665


class Session(SimpleNamespace):
    """Throws of which `starts` has the first rows."""

    times = swept = np.zeros(1)
    stones = np.zeros(2)

    def __len__(self) -> int:
        return len(self.starts) - 1

    def rows(self, k: int) -> slice:
        return slice(self.starts[k], self.starts[k + 1])


def points(ax) -> np.ndarray:
    """Place, value and standard error of the points with errors."""
    (drawn,) = ax.containers
    line, _, (bars,) = drawn.lines
    errors = [np.ptp(bar[:, 1]) / 2 for bar in bars.get_segments()]
    return np.column_stack([line.get_xydata(), errors])


# --- parts ----------------------------------------------------------------------------------------


def test_accelerations_are_along_the_travel_and_to_its_left():
    vectors = np.array([[1.0, 2.0], [1.0, 2.0], [1.0, 2.0], [3.0, 4.0]])
    velocity = np.array([[0.0, 2.0], [0.0, -2.0], [0.5, 0.0], [3.0, -4.0]])
    expected = [[2.0, -1.0], [-2.0, 1.0], [1.0, 2.0], [-1.4, 4.8]]
    assert module._in_travel(vectors, velocity) == pytest.approx(np.array(expected))


def test_signs_make_handles_and_directions_comparable():
    path = np.zeros((4, 6))
    path[:, State.OMEGA] = [2.0, -2.0, 2.0, -2.0]
    path[:, State.VY] = [1.0, 1.0, -1.0, -1.0]
    fitted = SimpleNamespace(predicted=path)
    spin, way = np.array([1.0, -1, 1, -1]), np.array([1.0, 1, -1, -1])
    one = np.ones(4)
    for pushes, signs in (
        ([], (one, one, -spin)),
        (["along"], (one, one, -spin)),
        (["left", "turn"], (one, spin, -spin)),
        (["along the sheet"], (way, way, -spin * way)),
        (["across the sheet"], (way, way, -spin * way)),
        (["left", "across the sheet"], (way, spin * way, -spin * way)),
    ):
        assert module._signs(fitted, pushes) == pytest.approx(np.column_stack(signs)), pushes


def test_means_of_levels_count_each_throw_once():
    value = np.array([1.0, 1, 1, 1, 2, 2, 2, 3, 3, 2])
    push = np.array([5.0, 5, 5, 9, 1, 2, 6, 8, 8, np.nan])
    owner = np.array([0, 0, 0, 1, 0, 0, 1, 0, 1, 2])
    place, mean, error = module._averaged(value, push, owner)
    assert place == pytest.approx([1.0, 2.0])  # two rows are too few
    assert mean == pytest.approx([7.0, (1.5 + 6.0) / 2])
    assert error == pytest.approx([2.0 / np.sqrt(2), 2.25 / np.sqrt(2)])


def test_many_values_fall_into_bins_of_equal_counts():
    value = np.arange(1.0, 57.0)
    place, mean, error = module._averaged(value, 10 * value, np.zeros(56, dtype=int))
    assert len(place) == 14
    assert place == pytest.approx(1.0 + 55 * (np.arange(14) + 0.5) / 14, abs=0.6)
    assert mean == pytest.approx(10 * place)
    assert (error == 0).all()
    few = np.repeat(np.arange(14.0), 3)
    assert module._averaged(few, few, np.zeros(42, dtype=int))[0] == pytest.approx(np.arange(14.0))
    assert len(module._averaged(value, value, np.zeros(56, dtype=int), 4)[0]) == 4


def test_local_accelerations_are_those_of_the_parabola():
    """One throw along (3, 4)/5 that is pushed to its left and turned, and one that is too short."""
    t = np.arange(0.0, 10.01, 0.1)
    forward, left = np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    run = 1.0 * t - 0.045 * t**2
    xy = run[:, None] * forward + (0.01 * t**2)[:, None] * left
    heading = 0.3 * t - 0.02 * t**2
    path = np.zeros((len(t) + 20, 6))
    path[: len(t), 2:4] = (1.0 - 0.09 * t)[:, None] * forward
    path[len(t) :, 2] = 1.0
    paths = np.zeros((len(path), 3))
    paths[: len(t)] = np.column_stack([xy, heading])
    paths[10:30, 2] = np.nan
    session = Session(
        starts=np.array([0, len(t), len(path)]),
        times=np.concatenate([t, np.arange(20) / 10]),
    )
    found = module._accelerations(SimpleNamespace(session=session, predicted=path), paths, 3.0)
    assert found.shape == (len(path), 3)
    known = np.flatnonzero(np.isfinite(found).all(axis=1))
    # Every eighth row, a second and a half from both ends, and above 0.15 m/s.
    expected = [k for k in range(0, 101, 8) if 15 <= k <= 85 and 1.0 - 0.009 * k >= 0.15]
    assert known.tolist() == expected
    assert found[known, 0] == pytest.approx(np.full(len(known), -0.09))
    assert found[known, 1] == pytest.approx(np.full(len(known), 0.02))
    late = known[known > 48]
    assert found[late, 2] == pytest.approx(np.full(len(late), -0.04))
    blind = paths.copy()
    blind[11:, 2] = np.nan
    blind[0, 2] = np.nan
    found = module._accelerations(SimpleNamespace(session=session, predicted=path), blind, 3.0)
    assert (found[known, 2] == 0.0).all()


def test_a_variable_is_that_of_the_row():
    path = np.arange(24.0).reshape(4, 6) / 3
    session = Session(
        starts=np.array([0, 2, 4]),
        times=np.array([0.0, 1.0, 0.0, 2.0]),
        swept=np.array([0.0, 1.0, 0.0, 0.0]),
        stones=np.array([7, 3]),
        owner=np.array([0, 0, 1, 1]),
    )
    fitted = SimpleNamespace(predicted=path, session=session)
    values = {
        "speed": np.sqrt(path[:, State.VX] ** 2 + path[:, State.VY] ** 2),
        "x": path[:, State.X],
        "y": path[:, State.Y],
        "t": session.times,
        "theta": path[:, State.THETA] % (2 * np.pi),
        "spin": path[:, State.OMEGA],
        "swept": session.swept,
        "stone": np.array([7.0, 7.0, 3.0, 3.0]),
    }
    for name, expected in values.items():
        assert module._value(fitted, name) == pytest.approx(expected), name


def test_passes_are_those_of_the_stones_before():
    sheet = Ice.uniform(MU).sheet
    passes = np.arange(3)[:, None, None] * np.arange(np.prod(sheet.shape)).reshape(sheet.shape)
    tracks = SimpleNamespace(
        before=lambda orders: np.asarray(orders) - 4, passes=lambda given: passes
    )
    session = Session(
        orders=np.array([5, 6]), owner=np.array([0, 0, 1]), wear_tracks=tracks, starts=[0, 2, 3]
    )
    path = np.zeros((3, 6))
    path[:, 1] = [0.0, 3.0, 3.0]
    fitted = SimpleNamespace(
        predicted=path, session=session, model=SimpleNamespace(wear_sheet=sheet)
    )
    rows, columns = sheet.cell_of(path[:, :2])
    expected = np.array([1, 1, 2]) * (rows * sheet.shape[1] + columns)
    assert module._value(fitted, "passes") == pytest.approx(expected)


# --- figures --------------------------------------------------------------------------------------


def test_frictions_of_throws_are_in_per_cent_before_and_after(monkeypatch):
    session = Session(
        starts=range(4),
        orders=np.array([0, 2, 3]),
        clocks=np.array([0.0, 90.0, 240.0]),
        stones=np.array([5, 5, 6]),
    )
    before, after = SimpleNamespace(session=session), SimpleNamespace(session=session)
    own = {id(before): np.array([0.01, 0.02, -0.03]), id(after): np.array([0.001, 0.002, 0.0])}
    monkeypatch.setattr(
        module, "own_frictions", lambda fit: (own[id(fit)], own[id(fit)] ** 2 + 0.001)
    )
    places = {"order": [0, 2, 3], "clock": [0, 1.5, 4], "stone": [5, 5 + 0.04 / 3, 6 + 0.08 / 3]}
    for variable, place in places.items():
        left, right = module._between_throws(before, after, variable).axes
        for ax, fit, title in ((left, before, "before"), (right, after, "after")):
            values = own[id(fit)]
            expected = np.column_stack([place, 100 * values, 100 * (values**2 + 0.001)])
            assert points(ax) == pytest.approx(expected)
            assert ax.get_title("left") == title
    assert left.get_xticks().tolist() == [5, 6]


@pytest.mark.parametrize("axis", [0, 1])
def test_displacements_are_shown_along_the_axis_that_changes_more(axis):
    """In millimetres; the residuals before are those after, and the shift."""
    n = 30
    path = np.zeros((n, 6))
    path[:, State.Y] = np.repeat([1.0, 2.0, 3.0], 10)
    values = {"size": 0.5}

    def displacement(xy, theta, given):
        assert given is values
        shift = np.column_stack([xy[:, 1], 0.1 * xy[:, 1]]) * 1e-3
        return shift if axis == 0 else shift[:, ::-1]

    residuals = np.tile([1e-4, 2e-4, 9.0], (n, 1))
    after = SimpleNamespace(
        predicted=path,
        residuals=residuals,
        session=Session(starts=[0, n], owner=np.zeros(n, dtype=int)),
        model=SimpleNamespace(
            term=lambda label: SimpleNamespace(
                card=SimpleNamespace(displacement=displacement), values=values
            )
        ),
    )
    left, right = module._displacements(after, "given", "y").axes
    y, left_over = np.array([1.0, 2.0, 3.0]), 0.1 * (axis + 1)
    assert points(left)[:, :2] == pytest.approx(np.column_stack([y, y + left_over]))
    assert points(right)[:, :2] == pytest.approx(np.column_stack([y, 0 * y + left_over]))
    assert left.lines[-1].get_xydata() == pytest.approx(np.column_stack([y, y]))
    assert left.get_ylabel().endswith(("across the sheet [mm]", "along the sheet [mm]")[axis])


@pytest.fixture
def within(monkeypatch):
    """Draw an effect or the unknown, from given accelerations of 12 rows on two levels of x."""
    owner = np.repeat([0, 1], 6)
    path = np.zeros((12, 6))
    path[:, State.X] = np.tile([20.0, 21.0], 6)
    path[:, State.OMEGA] = np.where(owner == 0, 1.0, -1.0)
    path[:, State.VY] = 1.0
    sizes = {
        10.0: np.array([0.030, 0.060, 0.090]),  # measured
        20.0: np.array([0.028, 0.055, 0.081]),  # by the improved model
        30.0: np.array([0.008, 0.015, 0.011]),  # by that without the effect
        40.0: np.array([0.001, 0.002, 0.003]),  # by that before
    }
    windows = []

    def accelerations(fitted, paths, window):
        windows.append(window)
        signs = np.column_stack([np.ones(12), np.where(owner == 0, 1, -1), np.ones(12)])
        return np.tile(sizes[paths[0, 0]], (12, 1)) * signs

    def predict(model, session, states, factors):
        assert (states, factors) == ("states", "factors")
        found = path.copy()
        found[:, State.X] = {"without curl": 30.0, "before": 40.0}[model]
        return found

    observed = np.full((12, 3), 10.0)
    after = SimpleNamespace(
        session=Session(starts=[0, 6, 12], owner=owner, observed=observed),
        predicted=path,
        states="states",
        ln_factors="factors",
        model=SimpleNamespace(without=lambda label: f"without {label}"),
    )
    monkeypatch.setattr(module, "_accelerations", accelerations)
    monkeypatch.setattr(module, "predict", predict)

    def draw(label, pushes=(), dependences=(), variable="x"):
        monkeypatch.setattr(module, "_pushes", lambda _: tuple(pushes))
        windows.clear()
        before = SimpleNamespace(model="before")
        return *module._within_throws(before, after, label, variable, list(dependences)).axes, set(
            windows
        )

    return draw


@pytest.mark.parametrize(
    ("pushes", "found", "left_over", "before", "words"),
    [
        (("along",), 20.0, 2.0, 22.0, "along the travel [mm/s²]"),
        (("along", "left"), 40.0, 5.0, 45.0, "to the side [mm/s²]"),
        (("along the sheet",), 20.0, 2.0, 22.0, "along the travel [mm/s²]"),
    ],
)
def test_an_effect_is_shown_where_it_pushes_most(within, pushes, found, left_over, before, words):
    """By the handle the side is, so that both throws push alike."""
    left, right, windows = within("curl", pushes)
    assert windows == {3.0}
    assert points(left)[:, 1] == pytest.approx([before] * 2)
    assert points(right)[:, 1] == pytest.approx([left_over] * 2)
    assert points(left)[:, 2] == pytest.approx([0.0] * 2)
    assert left.lines[-1].get_xydata() == pytest.approx(np.array([[20.0, found], [21.0, found]]))
    assert left.get_ylabel().endswith(words)


def test_a_loss_of_spin_is_against_the_spin(within):
    """The fixture turns both throws alike, so that one of them loses its turn and one gains it."""
    left, right, _ = within("curl", ("along", "turn"))
    assert points(left)[:, 1] == pytest.approx([0.0] * 2)
    assert points(left)[:, 2] == pytest.approx([79.0 / np.sqrt(2)] * 2)
    assert points(right)[:, 2] == pytest.approx([9.0 / np.sqrt(2)] * 2)
    assert left.get_ylabel().endswith("of spin [mrad/s²]")
    *_, windows = within("curl", ("along",), variable="theta")
    assert windows == {1.0}


@pytest.mark.parametrize(
    ("push", "before", "after", "spread"),
    [
        ("along", 29.0, 2.0, 0.0),
        ("along the sheet", 29.0, 2.0, 0.0),
        ("across the sheet", 0.0, 0.0, 58.0),
        ("left", 0.0, 0.0, 58.0),
    ],
)
def test_the_unknown_is_shown_without_signs_against_the_model_before(
    within, push, before, after, spread
):
    follows = [
        SimpleNamespace(variable="x", push=push),
        SimpleNamespace(variable="y", push="left"),
    ]
    left, right, _ = within("unknown", ("turn",), follows)
    assert points(left)[:, 1] == pytest.approx([before] * 2)
    assert points(right)[:, 1] == pytest.approx([after] * 2)
    assert points(left)[:, 2] == pytest.approx([spread / np.sqrt(2)] * 2)
    assert not [line for line in left.lines if line.get_label() == "the effect found"]


def test_each_effect_has_the_figure_of_its_kind(monkeypatch):
    calls = []
    for name in ("displacements", "between_throws", "within_throws"):
        monkeypatch.setattr(
            module, f"_{name}", lambda *given, name=name: calls.append((name, *given)) or name
        )
    monkeypatch.setattr(module, "replace", lambda fit, session: (fit, session))
    names = ["curl", "stone_bias", "time_drift", "of a user"]
    found = SimpleNamespace(
        session=SimpleNamespace(gates=None),
        effects=[SimpleNamespace(label=name) for name in names],
        dependences=[
            SimpleNamespace(variable="clock", push="along"),
            SimpleNamespace(variable="nothing shown", push="left"),
        ],
        final_base="before",
        final="after",
        seen=SimpleNamespace(session="all"),
    )
    shown = module.residual_pictures(found)
    assert shown == [
        ("curl", "within_throws"),
        ("stone_bias", "between_throws"),
        ("time_drift", "between_throws"),
        ("of a user", "within_throws"),
        ("unknown", "between_throws"),
    ]
    after = ("after", "all")
    assert calls[1] == ("between_throws", "before", after, "stone")
    assert calls[3] == ("within_throws", "before", after, "of a user", "speed", found.dependences)
    assert calls[4] == ("between_throws", "before", after, "clock")
    found.session.gates = object()
    assert module.residual_pictures(found) == []


def test_paths_are_seen_by_their_throwers():
    away = np.array([[0.5, -10.0], [0.25, 0.0], [0.1, 16.0]])
    home = np.array([[0.5, 10.0], [0.25, 0.0], [0.1, -16.0]])
    session = Session(starts=[0, 3, 6], xy=np.concatenate([away, home]))
    before, after = session.xy + 0.1, session.xy + 0.2
    found = SimpleNamespace(
        session=SimpleNamespace(only=lambda which: session if which == [1, 2] else None),
        held_out=[1, 2],
        final=SimpleNamespace(model=SimpleNamespace(ice=Ice.uniform(MU))),
        gaps={
            "before": SimpleNamespace(predicted=before),
            "after": SimpleNamespace(predicted=after),
        },
    )
    for when, forecast in (("before", before), ("after", after)):
        (ax,) = module.paths_picture(found, when).axes
        drawn = [line.get_xydata() for line in ax.lines[-8:]]
        expected = []
        for rows, way in ((slice(0, 3), 1), (slice(3, 6), -1)):
            for xy in (session.xy[rows], forecast[rows]):
                seen = way * xy - [0.0, TEE_Y]
                expected += [seen, seen[-1:]]
        for one, other in zip(drawn, expected, strict=True):
            assert one == pytest.approx(other)
        ticks = dict(
            zip([t.get_text() for t in ax.get_yticklabels()], ax.get_yticks(), strict=True)
        )
        assert ticks == pytest.approx(
            {"hog line": -TEE_Y - HOG_LINE_Y, "far hog line": HOG_LINE_Y - TEE_Y, "tee line": 0.0}
        )


def test_the_same_draw_rests_further_on_keener_ice_and_curls_to_its_left():
    curl = ActiveEffect(name="curl", parameters={"strength": 0.002, "speed_exponent": 0.2})
    ices = Ice.uniform(MU), Ice.uniform(0.98 * MU, effects=(curl,))
    base, final = (
        SimpleNamespace(model=SimpleNamespace(improved_ice=lambda _, ice=ice: ice)) for ice in ices
    )
    session = SimpleNamespace(
        wear_tracks=SimpleNamespace(paths=[]),
        stones=np.array([1]),
        orders=np.array([4]),
        clocks=np.array([60.0]),
    )
    found = SimpleNamespace(session=session, final_base=base, final=final, effects=[1])
    figure, words = module.draw_picture(found)
    parts = re.fullmatch(
        r"A counter-clockwise draw of ([\d.]+) m/s comes to rest on the tee line in the model "
        r"before, and ([\d.]+) c?m to the left and (\d+) cm further in the improved one\.",
        words,
    )
    run = HOG_LINE_Y + TEE_Y
    assert float(parts[1]) == pytest.approx(np.sqrt(2 * MU * G * run), rel=0.01)
    assert float(parts[3]) == pytest.approx(100 * run * (1 / 0.98 - 1), abs=3)
    (ax,) = figure.axes
    before, after = (line.get_xydata()[-1] for line in ax.lines[-2:])
    assert before == pytest.approx([0.0, 0.0], abs=0.02)
    assert after[0] < 0
    assert after[1] == pytest.approx(float(parts[3]) / 100, abs=0.03)
    found.final_base, found.final = final, base
    _, words = module.draw_picture(found, Units.FEET)
    assert "to the right and" in words
    assert "shorter in the improved one" in words
    assert " ft/s comes" in words
    found.effects = []
    assert module.draw_picture(found) is None


def test_the_draw_is_the_next_throw_on_the_ice_as_it_is_now(monkeypatch):
    """A minute after the last release, with the last stone, over the tracks of all before."""
    aimed, ran = [], []

    class Worn:
        def __init__(self, ice):
            self.ice = ice

        def ran(self, path):
            ran.append((self.ice, path))

        @property
        def now(self):
            return f"worn {self.ice}"

    def aim(ice, **at):
        aimed.append((ice, at))
        return SimpleNamespace(draw_weight=lambda spin: aimed.append(spin))

    monkeypatch.setattr(module, "IceInUse", Worn)
    monkeypatch.setattr(module, "Aim", aim)
    base, final = (
        SimpleNamespace(model=SimpleNamespace(improved_ice=lambda _, name=name: name))
        for name in ("base", "final")
    )
    session = SimpleNamespace(
        wear_tracks=SimpleNamespace(paths=["one", "two"]),
        stones=np.array([1, 6, 3]),
        orders=np.array([4, 9, 8]),
        clocks=np.array([60.0, 200.0, 190.0]),
    )
    found = SimpleNamespace(session=session, final_base=base, final=final, effects=[1])
    assert module.draw_picture(found) is None  # no draw rests there
    assert ran == [(ice, path) for ice in ("base", "final") for path in ("one", "two")]
    assert aimed == [("worn base", {"stone": 3, "order": 10, "clock": 260.0}), 1.5]
