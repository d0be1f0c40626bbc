"""Discovery of effects: where measurement and model disagree, and what the model lacks.

The noise of the tracks is learnt and the baseline is fitted to the same throws (`model`), beside
the systematic errors of the camera. Candidates are scored, fitted and chosen one by one (`search`),
then tested throw by throw and on throws that nothing was fitted to (`evidence`). A discrepancy that
no candidate explains is described by the variables that it follows.
"""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "assessment": ("assess",),
        "data.references": ("calibrate", "read_reference"),
        "data.session": ("open_session",),
        "discover": ("ice_of",),
        "evidence.hold_out": ("forecast", "noise_floor"),
        "evidence.mixture": ("mixture",),
        "evidence.posterior": ("draw_posterior",),
        "evidence.significance": ("own_frictions",),
        "evidence.unknown.explanation": ("Dependence",),
        "model.baseline": ("base_model", "first_friction"),
        "model.candidates": ("Term", "way_of"),
        "model.friction_field": ("CARD", "crossed_by", "field_along", "fields_to_try"),
        "model.model": ("Model",),
        "model.noise": ("CoordinateNoise",),
        "model.response": ("MEASURED",),
        "posterior_file": ("can_write_posterior", "write_posterior"),
        "report": ("document",),
        "search.maps": ("renew_map",),
        "search.selection": ("fit_with_noise",),
    },
)
