"""How well a model foretells whose patch was sought among all throws.

The search puts a rectangle where it serves the throws best, by chance too. A throw that helped to
find the place would be foretold too well, so that the place is sought again without it.
"""

from __future__ import annotations

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.evidence.predictive_density import left_out_densities
from friction_estimation.discovery.model.fit import SessionFit, fit, refit
from friction_estimation.discovery.search.patches import find_patches
from friction_estimation.discovery.tuning import MOST_PLACES_SOUGHT


def densities_with_place_sought(start: SessionFit, name: str) -> Floats:
    """Ln of the density of every throw where a patch's place was found without it, (k,).

    In many throws several are left out of a search together. Where a search finds no place, the
    density is that of the model without the patch.

    Parameters
    ----------
    start : fit without the patch
    name : name of its effect
    """
    count = len(start.session)
    out = left_out_densities(start)
    for first in range(min(count, MOST_PLACES_SOUGHT)):
        left_out = np.arange(first, count, MOST_PLACES_SOUGHT)
        others = np.setdiff1d(np.arange(count), left_out)
        if not len(others):
            continue
        part = fit(
            start.model,
            start.session.only(others),
            start.noise,
            states=start.states[others],
            ln_factors=start.ln_factors[others],
        )
        for term in find_patches(part):
            if term.name == name:
                beside = refit(start, start.model.with_terms(term))
                out[left_out] = left_out_densities(beside)[left_out]
    return out
