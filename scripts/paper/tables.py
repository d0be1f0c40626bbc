"""The paper's experiment repeated: its tables 3 and 4, and its figures 9 and 10.

Ten uniform ices from μ = 0.00182 to 0.002, throws at 1.6 m/s seen from hog line to hog line at 30
frames a second, 1 and 5 pitches; coordinates as measured, here with 5 mm of noise. At these
frictions, five times below real ice, a stone that nothing stops slides 65 m: only the stretch
between the hog lines counts.

Source
------
The paper, section 4.2, tables 3 and 4. The last row of table 3 is missing in print; the mean of
the nine rows printed is 0.631 %.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from curling_env.ice import Ice
from curling_env.infrastructure.files.storage import write_table
from curling_env.physics import slide
from curling_env.render.figures import FAINT, INK, new_figure, plain_axes, save_figure
from curling_env.sheet import HOG_LINE_Y, PAPER_STONE
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Progress, no_progress, with_progress
from friction_estimation import estimate_ice
from friction_estimation.design.cramer_rao import uniform_bound
from friction_estimation.estimation.paper_method import estimate_by_paper

THEORETICAL = np.round(np.arange(0.00182, 0.002001, 0.00002), 5)
"""The ten frictions of the paper's tables."""
MEASURED_BY_PAPER: dict[int, Floats] = {
    1: np.array(
        [0.001821067, 0.001851111, 0.001862963, 0.001871111, 0.001911111,
         0.001912, 0.001960488, 0.001979388, 0.002006486, np.nan]
    ),
    5: np.array(
        [0.00181737, 0.001830172, 0.001860159, 0.00187209, 0.001904035,
         0.001908194, 0.001933125, 0.001951935, 0.001991525, 0.002004082]
    ),
}  # fmt: skip
"""What the paper measured, by number of pitches; NaN where its table is cut off."""

SPEED = 1.6
"""Of every pitch [m/s]."""
SPIN = 1.0
"""Of every pitch [rad/s]; the paper fixes a rotation and does not say which."""
FPS = 30.0
NOISE = 0.005
"""Standard deviation of a coordinate [m]."""
HEADING_NOISE = 0.01
"""Standard deviation of the measured heading [rad]."""


@dataclass(frozen=True, kw_only=True)
class Table:
    """One of the paper's tables, repeated.

    Parameters
    ----------
    pitches : throws per friction
    theoretical : (10,) true μ
    joint, interval : (10,) and (10, 2) estimate of the trajectory fit and its 95 % interval
    averaged : (10,) estimate of the paper's own way on the same tracks
    paper : (10,) what the paper measured
    bound : (10,) smallest standard error that any method can have
    """

    pitches: int
    theoretical: Floats
    joint: Floats
    interval: Floats
    averaged: Floats
    paper: Floats
    bound: Floats

    def error_percent(self, measured: Floats) -> Floats:
        """Error rates as the paper's tables give them, (10,) [%]."""
        return 100 * np.abs(measured - self.theoretical) / self.theoretical


def pitch(mu: float, rng: np.random.Generator, number: int = 0) -> Trajectory:
    """One measured pitch of the experiment, hog line to hog line."""
    ice = Ice.uniform(mu, stone=PAPER_STONE)
    beyond = np.array([-1.0, 1.0, -HOG_LINE_Y - 1.0, HOG_LINE_Y])
    path = slide(ice, Throw(speed=SPEED, spin=SPIN).release(), bounds=beyond, fps=FPS).trajectory
    assert path is not None
    return Trajectory(
        t=path.t,
        xy=path.xy + rng.normal(0.0, NOISE, path.xy.shape),
        theta=path.theta + rng.normal(0.0, HEADING_NOISE, len(path)),
        throw=number,
    )


def repeat_table(
    pitches: int, rng: np.random.Generator, *, progress: Progress = no_progress
) -> Table:
    """Repeat one table.

    Parameters
    ----------
    pitches : throws per friction, 1 or 5 in the paper
    rng : of the measurement noise
    progress : called after every friction
    """
    joint, averaged, bound = (np.empty(len(THEORETICAL)) for _ in range(3))
    interval = np.empty((len(THEORETICAL), 2))
    start = Ice.uniform(0.0082, stone=PAPER_STONE)
    for k, mu in enumerate(with_progress(THEORETICAL.tolist(), f"{pitches} pitches", progress)):
        tracks = [pitch(mu, rng, number) for number in range(pitches)]
        found = estimate_ice(tracks, start=start, uniform=True)
        joint[k] = found.mu
        interval[k] = found.interval
        averaged[k] = estimate_by_paper(tracks, start=start, uniform=True).mu
        bound[k] = uniform_bound(
            [SPEED] * pitches, mu=mu, noise=NOISE, fps=FPS, distance=2 * HOG_LINE_Y
        )
    return Table(
        pitches=pitches,
        theoretical=THEORETICAL,
        joint=joint,
        interval=interval,
        averaged=averaged,
        paper=MEASURED_BY_PAPER.get(pitches, np.full(len(THEORETICAL), np.nan)),
        bound=bound,
    )


def as_text(table: Table) -> str:
    """The table for a terminal: error rates beside the paper's own."""
    joint, own, paper = (
        table.error_percent(values) for values in (table.joint, table.averaged, table.paper)
    )
    number = {1: "Table 3", 5: "Table 4"}.get(table.pitches, "Table")
    lines = [
        f"{number}. Initial velocity {SPEED} m/s, number of pitches {table.pitches}",
        "",
        "theoretical   joint fit   error    paper's way   error    the paper printed   error",
    ]
    for k, mu in enumerate(table.theoretical):
        printed = "—".rjust(17) + "—".rjust(11)
        if np.isfinite(paper[k]):
            printed = f"{table.paper[k]:17.9f}{paper[k]:9.3f} %"
        lines.append(
            f"{mu:11.5f}{table.joint[k]:12.7f}{joint[k]:7.3f} %{table.averaged[k]:14.7f}"
            f"{own[k]:7.3f} %  {printed}"
        )
    mean_bound = float(np.mean(table.bound / table.theoretical)) * 100
    lines += [
        f"{'mean':>11}{'':12}{joint.mean():7.3f} %{'':14}{own.mean():7.3f} %  {'':17}"
        f"{np.nanmean(paper):9.3f} %",
        f"No method can have a standard error below {mean_bound:.3f} %, which is a mean error of "
        f"{mean_bound * np.sqrt(2 / np.pi):.3f} %.",
    ]
    return "\n".join(lines)


def save_table(table: Table, path: Path) -> None:
    """The table as CSV."""
    write_table(
        path,
        {
            "theoretical": table.theoretical,
            "joint_fit": table.joint,
            "joint_low": table.interval[:, 0],
            "joint_high": table.interval[:, 1],
            "joint_error_percent": table.error_percent(table.joint),
            "paper_way": table.averaged,
            "paper_way_error_percent": table.error_percent(table.averaged),
            "bound_percent": 100 * table.bound / table.theoretical,
        },
    )


def draw_figure(table: Table, path: Path) -> None:
    """The paper's figure 9 or 10: theoretical values in blue, measured in red."""
    figure = new_figure(8.5, 5)
    ax = figure.subplots()
    steps = np.arange(1, len(table.theoretical) + 1)
    ax.plot(steps, table.theoretical, color="#1f4fbf", lw=2, label="theoretical")
    spread = np.abs(table.interval.T - table.joint)
    ax.errorbar(
        steps, table.joint, spread, color="#c8332b", lw=1.6, marker="o", ms=4, capsize=3,
        label="measured: joint fit, 95 % interval",
    )  # fmt: skip
    ax.plot(steps, table.averaged, color="#e0912f", lw=1, marker="s", ms=3, ls=":",
            label="measured: differentiated and averaged")  # fmt: skip
    ax.plot(steps, table.paper, color=FAINT, lw=1, marker="^", ms=4, ls="--",
            label="measured by the paper")  # fmt: skip
    plain_axes(ax)
    ax.set_xticks(steps)
    ax.set_xticklabels([f"{mu:.5f}" for mu in table.theoretical], fontsize=8)
    ax.set_xlabel("theoretical coefficient of friction", fontsize=9, color=INK)
    ax.set_ylabel("coefficient of friction", fontsize=9, color=INK)
    name = {1: "Figure 9", 5: "Figure 10"}.get(table.pitches, "Figure")
    many = "1 pitch" if table.pitches == 1 else f"{table.pitches} pitches"
    error = table.error_percent(table.joint).mean()
    printed = np.nanmean(table.error_percent(table.paper))
    ax.set_title(
        f"{name}, {many} at {SPEED} m/s: mean error {error:.3f} % (the paper: {printed:.3f} %)",
        fontsize=11, color=INK,
    )  # fmt: skip
    ax.legend(frameon=False, fontsize=8, loc="upper left")
    save_figure(figure, path)
