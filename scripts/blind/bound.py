"""Best possible knowledge of the ice from a session: the joint Bayesian bound.

Unknown are the friction map (its prior is the true one: a Gaussian correlation of the true size and
length), the parameters of all hidden effects, the level of friction, the coupling of the spin, each
throw's release, and its own friction, with the true scatter. The noise is the true one.
The generator's own law is linearised about the true paths (`linearised`).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from blind.camera import HEADING
from blind.hidden import STRENGTH_PLACES
from blind.law import MAP_LENGTH, MAP_SD, SQUARES, WEAR_ALONG, run_over
from blind.linearised import FREE, WIDE, measured, respond, whitened
from blind.sessions import release_of
from curling_env.sheet import PAPER_SHEET
from curling_env.trajectory import Trajectory
from curling_env.typing import Flags, Floats

LEFT_OUT = 1e-6
"""Share of the field's variance that its coarse basis may miss."""


class Bound(NamedTuple):
    """Best possible knowledge of the map of a session.

    Parameters
    ----------
    crossed : (89, 9) true if a stone's centre crossed the cell
    rmse : error of ln μ in the crossed cells, root mean square, without their mean
    """

    crossed: Flags
    rmse: float


def _crossed_by(paths: list[Floats]) -> Flags:
    crossed = np.zeros(PAPER_SHEET.shape, dtype=bool)
    for path in paths:
        crossed[PAPER_SHEET.cell_of(path[PAPER_SHEET.contains(path[:, :2]), :2])] = True
    return crossed


def paths_of(sealed: dict[str, Any], throws: int) -> list[tuple[Floats, Floats]]:
    """Return passes of earlier stones, and the true path (n, 6), of each throw of the session."""
    q, pattern = np.array(sealed["numbers"]), np.array(sealed["pattern"]).reshape(-1, 3)
    passes = np.zeros(SQUARES)
    out: list[tuple[Floats, Floats]] = []
    for document in sealed["throws"][:throws]:
        path = release_of(document).path(q, pattern, passes)
        out.append((passes.copy() if q[WEAR_ALONG] else passes, path))
        if q[WEAR_ALONG]:
            run_over(passes, path)
    return out


def bound_of(sealed: dict[str, Any], tracks: list[Trajectory]) -> Bound:
    """Compute the joint Bayesian bound of a session.

    Parameters
    ----------
    sealed : the truth; a map, if there is one, is a Gaussian field
    tracks : tracks of the session, of which only the times of the frames are read
    """
    q, pattern = np.array(sealed["numbers"]), np.array(sealed["pattern"]).reshape(-1, 3)
    basis = field_basis(q[MAP_SD], q[MAP_LENGTH])
    places = free_places(sealed)
    errors = {k: np.array(v) if k == "offset" else v for k, v in sealed["camera"].items()}
    lens = camera_steps(errors)
    widths = [1.0, 1.0, *(WIDE[place] for place in places), *(width for _, _, width in lens)]
    prior: Floats = np.array([*widths, *np.ones(basis.shape[-1])], dtype=np.float64)
    information: Floats = np.diag(1.0 / prior**2)
    paths = paths_of(sealed, len(tracks))
    for track, document, (passes, path) in zip(tracks, sealed["throws"], paths, strict=False):
        release = release_of(document)
        response = respond(release, path, q, pattern, passes, places, basis)
        columns = measured(response, track.t, errors, lens)
        columns = np.concatenate(
            [
                whitened(columns[:, j], track.t, sigma, memory)
                for j, (sigma, memory) in enumerate(
                    [(sealed["sigma"], sealed["memory"])] * 2 + [(HEADING, 0.0)]
                )
            ]
        )
        # The release, and the throw's own friction in addition to that of the session, are
        # independent.
        own, shared = columns[:, :7], columns[:, 6:]
        inner = own.T @ own
        inner[6, 6] += sealed["scatter"] ** -2.0
        size = np.diag(inner) ** -0.5
        cross = size[:, None] * (own.T @ shared)
        information += shared.T @ shared - cross.T @ np.linalg.solve(
            inner * np.outer(size, size), cross
        )
    scale = np.outer(prior, prior)
    covariance: Floats = scale * np.linalg.inv(information * scale)
    crossed = _crossed_by([path for _, path in paths])
    cells = basis[crossed]
    cells = cells - cells.mean(axis=0)
    field = covariance[len(covariance) - basis.shape[-1] :, len(covariance) - basis.shape[-1] :]
    rmse = float(np.sqrt(np.einsum("cj,jk,ck->c", cells, field, cells).mean()))
    return Bound(crossed, rmse)


def field_basis(sd: float, length: float) -> Floats:
    """Return a coarse basis of the field in the cells, (89, 9, m), with standard normal
    coefficients.

    Empty (m = 0) if there is no field.
    """
    if sd == 0.0:
        return np.empty((*PAPER_SHEET.shape, 0))
    x, y = np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres)
    squared = (x.ravel()[:, None] - x.ravel()) ** 2 + (y.ravel()[:, None] - y.ravel()) ** 2
    values, vectors = np.linalg.eigh(sd**2 * np.exp(-squared / (2.0 * length**2)))
    values, vectors = values[::-1], vectors[:, ::-1]
    kept = 1 + int(np.argmax(np.cumsum(values) > (1.0 - LEFT_OUT) * values.sum()))
    return (vectors[:, :kept] * np.sqrt(values[:kept])).reshape(*PAPER_SHEET.shape, kept)


def free_places(sealed: dict[str, Any]) -> list[int]:
    """Return places of all parameters that act on the stone and are not given."""
    names = {name.partition(":")[0] if name not in FREE else name for name in sealed["effects"]}
    names |= set(STRENGTH_PLACES) if "strengths" in sealed else set()
    return sorted({place for name in names for place in FREE.get(name, ())})


def camera_steps(errors: dict[str, Any]) -> list[tuple[dict[str, Any], float, float]]:
    """Return for each unknown of the camera: the errors after a small step, the step, and its
    width.
    """
    out: list[tuple[dict[str, Any], float, float]] = []
    if "offset" in errors:
        out += [
            ({**errors, "offset": errors["offset"] + step}, 1e-4, 0.2) for step in 1e-4 * np.eye(2)
        ]
    if "k1" in errors:
        out += [({**errors, "k1": errors["k1"] + 1e-5}, 1e-5, 0.1)]
        out += [({**errors, "centre": errors["centre"] + 1e-3}, 1e-3, 20.0)]
    return out
