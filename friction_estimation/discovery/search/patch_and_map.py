"""A patch with a smooth map, in place of a map as rough as the patch's sides.

A map that came first has taken a part of the patch. Beside it the patch is too wide and too weak,
or promises nothing, and no small step leads away from there. Around such a fit every smoother map
and every rectangle are linear, so that the pair that promises most is found without fitting any.
"""

from __future__ import annotations

from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.friction_field import CARD, FrictionField
from friction_estimation.discovery.model.quadratic import profile_amplitudes
from friction_estimation.discovery.search.maps import OtherMap, fields_of, with_other_maps
from friction_estimation.discovery.search.patches import (
    Rectangle,
    grid_over,
    rectangle_beside,
    responses_of_cells,
)
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
    session, model, paths = fitted.session, fitted.model, fitted.paths
    present = model.map_field
    assert present is not None
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
    linear = fitted.linear_in(other.model, other.columns, other.residual)
    model, _ = profile_amplitudes(linear.model, linear.each()[0].sum(axis=0))
    field = model.map_field
    assert field is not None
    return other._replace(field=field, model=model), linear.least()
