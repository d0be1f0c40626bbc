"""The search for the correlation length of a friction map."""

from __future__ import annotations

import numpy as np

from friction_estimation.discovery import (
    CARD,
    FrictionField,
    Model,
    Term,
    base_model,
    crossed_by,
    field_along,
    fit_with_noise,
    open_session,
    refit,
    renew_map,
)


def test_a_map_of_the_wrong_length_is_renewed_and_nearer_to_the_truth(sliding) -> None:
    rng = np.random.default_rng(11)
    truth = sliding.random_field(rng, mu=0.009, spread=0.06, length=5.0)
    tracks = sliding.measured_throws(truth, sliding.varied_starts(rng, 6), rng, fps=10)
    base = fit_with_noise(base_model(None, open_session(tracks)), open_session(tracks))
    session, sheet = base.session, base.model.ice.sheet
    paths = [session.xy[session.rows(i)] for i in range(len(session))]
    short = field_along(sheet, crossed_by(sheet, paths), 1.0, np.inf)
    first = refit(base, base.model.with_terms(Term(card=CARD, map_field=short)))
    renewed = renew_map(first)
    wanted = np.log(truth(*np.meshgrid(sheet.x_centres, sheet.y_centres)) / 0.009)

    def field_of(model: Model) -> FrictionField:
        assert model.map_field is not None
        return model.map_field

    def error(model: Model) -> float:
        field = field_of(model)
        return float(np.std((field.ln_mu - wanted).ravel()[field.crossed]))

    assert field_of(renewed.model).length > 2.5
    assert renewed.deviance < first.deviance - 10.0
    assert error(renewed.model) < 0.8 * error(first.model)
    # Around the new map no other promises more by as much.
    assert field_of(renew_map(renewed).model).length == field_of(renewed.model).length
