"""A patch and a smooth map in place of a map as rough as the patch's sides."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.discovery import (
    CARD,
    Term,
    base_model,
    crossed_by,
    field_along,
    find_patches,
    fit_with_noise,
    open_session,
    refit,
)
from friction_estimation.discovery.search.selection import patch_and_smoother_map

FACTOR = 0.8
SIDES = (5.0, 11.0)


def test_a_patch_that_a_map_had_taken_gets_its_size_back(sliding) -> None:
    rng = np.random.default_rng(7)
    smooth = sliding.random_field(rng, mu=0.009, spread=0.03, length=4.0)

    def truth(x, y):
        return smooth(x, y) * np.where((y > SIDES[0]) & (y < SIDES[1]), FACTOR, 1.0)

    tracks = sliding.measured_throws(truth, sliding.varied_starts(rng, 6), rng, fps=5)
    base = fit_with_noise(base_model(None, open_session(tracks)), open_session(tracks))
    session, sheet = base.session, base.model.ice.sheet
    paths = [session.xy[session.rows(i)] for i in range(len(session))]
    rough = field_along(sheet, crossed_by(sheet, paths), 1.2, 2.5)
    mapped = refit(base, base.model.with_terms(Term(card=CARD, map_field=rough)))
    (patch,) = find_patches(mapped)
    wide = patch.with_values(y_min=3.0, y_max=13.0, factor=0.9)
    beside = refit(mapped, mapped.model.with_terms(wide))
    trial = patch_and_smoother_map(beside)
    assert trial is not None
    found = trial.fit
    assert trial.gain == pytest.approx(beside.deviance - found.deviance)
    placed = found.model.term(patch.label).values
    assert found.deviance < beside.deviance - 20.0
    assert [placed["y_min"], placed["y_max"]] == pytest.approx(SIDES, abs=0.5)
    assert placed["factor"] == pytest.approx(FACTOR, abs=0.04)
    assert found.model.map_field.length > 2.5
