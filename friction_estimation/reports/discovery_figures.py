"""Figures of a discovery: forecast and measured paths, and residuals with the effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Literal

import numpy as np
from matplotlib.figure import Figure

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.aim import Aim
from curling_env.physics.effects.card import Push
from curling_env.physics.slides import NO_BOUNDS, slide
from curling_env.physics.state import State
from curling_env.physics.wear import IceInUse
from curling_env.render.figures import (
    FAINT,
    INK,
    draw_sheet,
    draw_stone,
    from_the_thrower,
    new_figure,
    plain_axes,
    show_house,
)
from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, TEE_Y, Direction
from curling_env.throw import Throw
from curling_env.typing import Floats, Indices
from curling_env.units import Units, short_length, speed
from friction_estimation.discovery.discover import Discovery
from friction_estimation.discovery.evidence.significance import own_frictions
from friction_estimation.discovery.evidence.unknown.explanation import Dependence
from friction_estimation.discovery.model.candidates import card_of, way_of
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.model import predict
from friction_estimation.discovery.model.response import MEASURED
from friction_estimation.tracks.smoothing import local_fit

BEFORE, AFTER, TRACK = "#c8433f", "#2b7a4b", "#22313f"
ACCELERATION_WINDOW = 3.0
"""Width of the windows for residual accelerations [s]."""
DRAW_SPIN = 1.5
"""Spin of the draw, counter-clockwise [rad/s]: two and a half turns until rest."""
EVERY_NTH_ROW = 8
"""Number of rows from one such window to the next."""
COMPONENT = {"along": 0, "left": 1, "turn": 2, "along the sheet": 0, "across the sheet": 1}
"""Index of the acceleration that a push changes: along the travel, to its left, rotation."""
LABELS = {
    "speed": "speed [m/s]",
    "y": "along the sheet, y [m]",
    "x": "across the sheet, x [m]",
    "t": "seconds since release",
    "theta": "heading of the handle [rad]",
    "spin": "spin [rad/s]",
    "order": "throws played before",
    "clock": "session clock [min]",
    "stone": "stone",
    "swept": "unswept | swept",
    "passes": "earlier stones that ran over the place",
}


def paths_picture(found: Discovery, when: Literal["before", "after"]) -> Figure:
    """Draw the measured and forecast paths of the held-out throws, as their throwers see them.

    The scale across the sheet is larger, so that a difference of a stone's width is visible.

    Parameters
    ----------
    found : the discovery
    when : forecast by the model ``before`` or ``after``
    """
    session, sheet = found.session.only(found.held_out), found.final.model.ice.sheet
    colour = BEFORE if when == "before" else AFTER
    figure = new_figure(4.4, 4.9)
    ax = figure.subplots()
    draw_sheet(ax, sheet, from_the_thrower(Direction.AWAY))
    for i in range(len(session)):
        rows = session.rows(i)
        measured, forecast = session.xy[rows], found.gaps[when].predicted[rows]
        away = measured[-1, 1] > measured[0, 1]
        view = from_the_thrower(Direction.AWAY if away else Direction.HOME)
        for xy, style, own, width, alpha, name in (
            (measured, "-", TRACK, 4.0, 0.4, "measured"),
            (forecast, "--", colour, 1.6, 1.0, "forecast"),
        ):
            ax.plot(*view(xy).T, style, color=own, lw=width, alpha=alpha, label=name, zorder=5)
            ax.plot(*view(xy[-1:]).T, "o", color=own, ms=2 + width, alpha=alpha, zorder=6)
    ax.set_xlim(-sheet.width / 2, sheet.width / 2)
    ax.set_ylim(-TEE_Y - HOG_LINE_Y - 0.5, BACK_LINE_Y - TEE_Y + 0.5)
    ax.set_aspect("auto")
    ax.set_xticks([])
    lines = {"hog line": -TEE_Y - HOG_LINE_Y, "far hog line": HOG_LINE_Y - TEE_Y, "tee line": 0.0}
    ax.set_yticks(list(lines.values()), list(lines), fontsize=9)
    handles, names = ax.get_legend_handles_labels()
    ax.legend(handles[:2], names[:2], loc="lower right", fontsize=9, framealpha=0.8)
    return figure


def draw_picture(found: Discovery, units: Units = Units.METRES) -> tuple[Figure, str] | None:
    """Draw the house with a draw that rests on the tee line under the earlier model, and describe
    its rest under the improved one.

    None if no effect was named, or no draw comes to rest there.
    """
    session = found.session
    ices: list[Ice] = []
    for fitted in (found.final_base, found.final):
        in_use = IceInUse(fitted.model.improved_ice({}))
        for ran in session.wear_tracks.paths:
            in_use.ran(ran)
        ices.append(in_use.now)
    stone, order = int(session.stones[-1]), int(session.orders.max()) + 1
    at = {"stone": stone, "order": order, "clock": float(session.clocks.max()) + 60.0}
    weight = Aim(ices[0], **at).draw_weight(DRAW_SPIN) if found.effects else None
    if weight is None:
        return None
    release = Throw(speed=weight, spin=DRAW_SPIN).release(Direction.AWAY, **at)
    try:
        runs = [slide(ice, release, bounds=NO_BOUNDS, fps=20.0).trajectory for ice in ices]
    except InputError:
        return None  # ice on which the stone never stops
    figure = new_figure(4.4, 4.3)
    ax = figure.subplots()
    view, sheet = from_the_thrower(Direction.AWAY), ices[0].sheet
    draw_sheet(ax, sheet, view)
    rests: list[Floats] = []
    for run, colour, name in zip(
        runs, (BEFORE, AFTER), ("the model before", "the improved model"), strict=True
    ):
        assert run is not None  # a rate was given
        ax.plot(*view(run.xy).T, color=colour, lw=2, zorder=5, label=name)
        draw_stone(ax, ices[0].stone.radius, run.xy[-1], view, colour=colour)
        rests.append(view(run.xy[-1:])[0])
    lowest, highest = min(r[1] for r in rests), max(r[1] for r in rests)
    show_house(
        ax,
        sheet,
        short=float(np.clip(0.6 - lowest, 2.6, 8.0)),
        past=float(np.clip(highest + 0.6, 2.4, 4.5)),
        units=units,
    )
    ax.set_aspect("equal")
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), fontsize=8, frameon=False)
    right, past = (rests[1] - rests[0]).tolist()
    return figure, (
        f"A counter-clockwise draw of {speed(weight, units)} comes to rest on the tee line in the "
        f"model before, and {short_length(right, units)} to the "
        f"{'right' if right > 0 else 'left'} and {short_length(past, units)} "
        f"{'further' if past > 0 else 'shorter'} in the improved one."
    )


def residual_pictures(found: Discovery) -> list[tuple[str, Figure]]:
    """Residuals before and after, for every named effect and each variable of the unknown.

    None for throws that gates timed: their few rows show no curve.
    """
    if found.session.gates is not None:
        return []
    ways = [(effect.label, way_of(effect.label)) for effect in found.effects]
    wanted = [(label, "speed" if way is None else way.shown_over) for label, way in ways]
    wanted += [("unknown", d.variable) for d in found.dependences if d.variable in LABELS]
    out: list[tuple[str, Figure]] = []
    before, after = found.final_base, replace(found.final, session=found.seen.session)
    for label, variable in wanted:
        card = card_of(label)
        if card is not None and card.displacement is not None:
            out.append((label, _displacements(after, label, variable)))
        elif variable in ("order", "clock", "stone") and "left" not in _pushes(label):
            out.append((label, _between_throws(before, after, variable)))
        else:
            out.append((label, _within_throws(before, after, label, variable, found.dependences)))
    return out


def _pushes(label: str) -> tuple[Push, ...]:
    """Return the pushes of an effect; empty if it is not known."""
    way = way_of(label)
    return way.pushes if way is not None else ()


def _before_and_after(
    pairs: Sequence[tuple[Floats, Floats, Floats]],
    variable: str,
    what: str,
    effect: tuple[Floats, Floats] | None = None,
) -> Figure:
    """Draw values with their standard errors over a variable, before and after.

    Parameters
    ----------
    pairs : variable, value and standard error of each point, before and after
    variable : name of the variable
    what : label of the values
    effect : variable and values of the effect that was found, drawn into the figure before
    """
    figure = new_figure(8.6, 2.9)
    axes = figure.subplots(1, 2, sharey=True)
    for ax, (place, value, error), colour, name in zip(
        axes, pairs, (BEFORE, AFTER), ("before", "after"), strict=True
    ):
        plain_axes(ax, LABELS[variable])
        ax.errorbar(place, value, error, fmt="o", color=colour, ms=4.5, lw=1)
        ax.axhline(0, color=FAINT, lw=0.8)
        ax.set_title(name, fontsize=9, loc="left")
        if variable == "swept":
            ax.set_xticks([0, 1], ["unswept", "swept"])
        if variable == "stone":
            ax.set_xticks(np.unique(np.round(place)))
    if effect is not None:
        axes[0].plot(*effect, color=INK, lw=1.6, label="the effect found")
        axes[0].legend(fontsize=8, frameon=False)
    axes[0].set_ylabel(what, fontsize=9)
    return figure


def _between_throws(before: SessionFit, after: SessionFit, variable: str) -> Figure:
    """Return the throws' own frictions over a variable that may change them."""
    session = before.session
    place = {
        "order": session.orders.astype(float),
        "clock": session.clocks / 60.0,
        "stone": session.stones + 0.04 * np.arange(len(session)) / len(session),
    }[variable]
    pairs = [(place, 100 * own, 100 * sigma) for own, sigma in map(own_frictions, (before, after))]
    return _before_and_after(pairs, variable, "friction of the throw\nbeyond the model [%]")


def _displacements(after: SessionFit, label: str, variable: str) -> Figure:
    """Reported minus true position over a variable, along the axis on which it changes more."""
    term = after.model.term(label)
    displacement = term.card.displacement
    assert displacement is not None
    path, owner = after.predicted, after.session.owner
    shift = 1e3 * displacement(path[:, :2], path[:, State.THETA], term.values)
    value, residuals = _value(after, variable), 1e3 * after.residuals[:, :2]
    averages = [_averaged(value, shift[:, axis], owner) for axis in range(2)]
    part = int(np.argmax([np.ptp(average[1]) for average in averages]))
    pairs = [_averaged(value, each[:, part], owner) for each in (residuals + shift, residuals)]
    what = f"reported less true place,\n{('across', 'along')[part]} the sheet [mm]"
    return _before_and_after(pairs, variable, what, averages[part][:2])


def _within_throws(
    before: SessionFit, after: SessionFit, label: str, variable: str, dependences: list[Dependence]
) -> Figure:
    """Unexplained accelerations over a variable, and the contribution of the effect."""
    session = after.session
    window = 1.0 if variable == "theta" else ACCELERATION_WINDOW
    seen = _accelerations(after, session.observed, window)
    model = _accelerations(after, after.predicted[:, MEASURED], window)
    # All other effects stay, so that the figure shows this one.
    unknown = label == "unknown"
    base_model = before.model if unknown else after.model.without(label)
    base_path = predict(base_model, session, after.states, after.ln_factors)
    base = _accelerations(after, base_path[:, MEASURED], window)
    pushes: Sequence[Push] = _pushes(label)
    if unknown:
        pushes = [d.push for d in dependences if d.variable == variable]
    sign = 1e3 * _signs(after, [] if unknown else pushes)
    effect = (model - base) * sign
    size = np.nanmean(np.abs(effect), axis=0)
    if unknown:
        part = max((COMPONENT[push] % 2 for push in pushes), default=0)
    else:
        part = max((COMPONENT[push] for push in pushes), key=lambda k: size[k])
    value = _value(after, variable)
    pairs = [
        _averaged(value, ((seen - other) * sign)[:, part], session.owner) for other in (base, model)
    ]
    what = (
        "unexplained push\nalong the travel [mm/s²]",
        "unexplained push\nto the side [mm/s²]",
        "unexplained loss\nof spin [mrad/s²]",
    )[part]
    found = None if unknown else _averaged(value, effect[:, part], session.owner)[:2]
    return _before_and_after(pairs, variable, what, found)


def _in_travel(vectors: Floats, velocity: Floats) -> Floats:
    """Components of vectors (n, 2) of the sheet frame along the travel and to its left, (n, 2)."""
    travel = velocity / np.maximum(np.hypot(*velocity.T), 1e-6)[:, None]
    return np.column_stack(
        [
            (vectors * travel).sum(axis=1),
            vectors[:, 1] * travel[:, 0] - vectors[:, 0] * travel[:, 1],
        ]
    )


def _value(fitted: SessionFit, variable: str) -> Floats:
    """Return the variable at every row, (rows,)."""
    path, session = fitted.predicted, fitted.session
    if variable == "passes":
        sheet = fitted.model.wear_sheet
        stones = session.wear_tracks.before(session.orders)[session.owner]
        return session.wear_tracks.passes(sheet)[stones, *sheet.cell_of(path[:, :2])]
    return {
        "speed": np.hypot(path[:, 2], path[:, 3]),
        "y": path[:, State.Y],
        "x": path[:, State.X],
        "t": session.times,
        "theta": np.mod(path[:, State.THETA], 2 * np.pi),
        "spin": path[:, State.OMEGA],
        "swept": session.swept,
        "stone": session.stones[session.owner].astype(float),
    }[variable]


def _signs(fitted: SessionFit, pushes: Sequence[Push]) -> Floats:
    """Signs that make the accelerations of different throws comparable, (rows, 3)."""
    sign = np.ones((len(fitted.predicted), 3))
    sign[:, 2] = -np.sign(fitted.predicted[:, State.OMEGA])
    if "left" in pushes:
        sign[:, 1] = np.sign(fitted.predicted[:, State.OMEGA])
    if {"along the sheet", "across the sheet"} & set(pushes):
        sign *= np.sign(fitted.predicted[:, State.VY])[:, None]
    return sign


def _accelerations(fitted: SessionFit, paths: Floats, window: float) -> Floats:
    """Accelerations along the travel, to its left and of the rotation, by local quadratics.

    Returns
    -------
    (rows, 3) [m/s², rad/s²]; NaN in most rows and near the ends of a throw
    """
    session, path = fitted.session, fitted.predicted
    out = np.full((len(path), 3), np.nan)
    for i in range(len(session)):
        whole = session.rows(i)
        t = session.times[whole]
        if t[-1] - t[0] < 2 * window:
            continue
        known = np.isfinite(paths[whole, 2])
        heading = np.interp(t, t[known], paths[whole, 2][known]) if known.sum() > 10 else 0.0 * t
        columns = (paths[whole, 0], paths[whole, 1], heading)
        second = [local_fit(t, column, window)[0][2][::EVERY_NTH_ROW] for column in columns]
        rows = np.arange(whole.start, whole.stop, EVERY_NTH_ROW)
        parts = np.column_stack(
            [_in_travel(np.column_stack(second[:2]), path[rows, 2:4]), second[2]]
        )
        u = t[::EVERY_NTH_ROW]
        slow = np.hypot(path[rows, 2], path[rows, 3]) < 0.15
        parts[(u - t[0] < window / 2) | (t[-1] - u < window / 2) | slow] = np.nan
        out[rows] = parts
    return out


def _averaged(
    value: Floats, push: Floats, owner: Indices, bins: int = 14
) -> tuple[Floats, Floats, Floats]:
    """Means over bins of a variable, with errors from the spread between throws.

    Returns
    -------
    mean variable, mean push and its standard error, of each bin
    """
    seen = np.isfinite(push)
    value, push, owner = value[seen], push[seen], owner[seen]
    levels = np.unique(value)
    edges = (
        np.quantile(value, np.linspace(0, 1, bins + 1))
        if len(levels) > bins
        else np.concatenate([levels - 1e-9, [levels[-1] + 1e-9]])
    )
    middle, mean, error = [], [], []
    for low, high in pairwise(edges):
        inside = (value >= low) & (value <= high)
        if inside.sum() < 3:
            continue
        per_throw = [push[inside & (owner == k)].mean() for k in np.unique(owner[inside])]
        middle.append(value[inside].mean())
        mean.append(float(np.mean(per_throw)))
        error.append(float(np.std(per_throw) / np.sqrt(len(per_throw))))
    return np.array(middle), np.array(mean), np.array(error)
