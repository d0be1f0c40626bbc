"""A patch with a smooth map, in place of a map as rough as the patch's sides.

A map that came first has taken a part of the patch. Beside it the patch is too wide and too weak,
or promises nothing, and no small step leads away from there. Around such a fit every smoother map
and every rectangle are linear, so that the pair that promises most is found without fitting any.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_estimation.discovery.model.elimination import (
    eliminate_factor,
    eliminate_states,
    gram_matrices,
)
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.friction_field import CARD, FrictionField
from friction_estimation.discovery.model.quadratic import profile_amplitudes
from friction_estimation.discovery.model.sensitivity import linearised_paths
from friction_estimation.discovery.search.maps import OtherMap, fields_of, with_other_maps
from friction_estimation.discovery.search.patches import (
    Rectangle,
    grid_over,
    rectangle_beside,
    responses_of_cells,
)
from friction_estimation.discovery.search.score_test import least_deviance
from friction_estimation.discovery.tuning import FINE_PATCH_CELL, ROUGH_MAP


def find_patch_and_map(fitted: SessionFit) -> tuple[Rectangle, FrictionField] | None:
    """The rectangle and the smoother map beside it that together promise most.

    Parameters
    ----------
    fitted : fit of a model with a rough map and without a patch

    Returns
    -------
    the rectangle, and the map, with what it can take over of the present one; None where no
    rectangle promises anything
    """
    session, model = fitted.session, fitted.model
    present = model.map_field
    assert present is not None
    paths = linearised_paths(model, session, fitted.states, fitted.ln_factors)
    grid = grid_over(paths.xy, FINE_PATCH_CELL)
    cells = responses_of_cells(paths, grid)
    fields = [f for f in fields_of(session, model.ice.sheet) if f.length > ROUGH_MAP]
    best: tuple[float, Rectangle, FrictionField] | None = None
    for other in with_other_maps(fitted, model.without(CARD.name), fields):
        other, without = _at_its_size(fitted, other)
        found = rectangle_beside(fitted, other.model, other.columns, other.residual, cells, grid)
        if found is not None and (best is None or without - found.gain < best[0]):
            best = (without - found.gain, found.rectangle, other.field)
    return None if best is None else (best[1], best[2].near(present.ln_mu))


def _at_its_size(fitted: SessionFit, other: OtherMap) -> tuple[OtherMap, float]:
    """A model with the most likely amplitude of its map, and F at its least without a patch."""
    stacked = np.concatenate([other.columns, other.residual[:, :, None]], axis=2)
    reduced = eliminate_states(gram_matrices(fitted.session, fitted.noise, stacked))
    spread = fitted.model.spread
    total = eliminate_factor(reduced, fitted.ln_factors, spread)[0].sum(axis=0)
    model, _ = profile_amplitudes(replace(other.model, spread=spread), total)
    field = model.map_field
    assert field is not None
    least = least_deviance(fitted, other.model, reduced)
    return other._replace(field=field, model=model), least
