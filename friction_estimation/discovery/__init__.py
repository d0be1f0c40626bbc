"""Discovery of effects that a model of the ice lacks.

The noise of the tracks is estimated and the baseline is fitted to the same throws (`model`), beside
the systematic errors of the camera. Candidates are scored, fitted and chosen one by one (`search`),
then tested throw by throw and on held-out throws (`evidence`). A discrepancy that no candidate
explains is described by the variables that it follows.
"""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "data.measurement": ("measurement_effects", "measurement_effects_through"),
        "data.outliers": ("without_outliers",),
        "data.references": ("calibrate", "calibrations_of", "corrected", "read_reference"),
        "data.session": ("open_session",),
        "discover": ("exceptional_throws", "ice_of"),
        "evidence.hold_out": ("choose_held_out", "forecast", "noise_floor"),
        "evidence.intervals": ("common_errors", "map_errors", "mixture", "standard_errors"),
        "evidence.next_throws": ("next_throws",),
        "evidence.posterior": ("draw_posterior",),
        "evidence.significance": (
            *("strongest_correlation", "friction_structure", "left_out_scores", "own_frictions"),
            *("p_of_mean", "unseen_scores"),
        ),
        "evidence.unknown.explanation": ("Dependence", "explain", "find_dependences", "fit_beside"),
        "evidence.unknown.nearby": ("Combination", "Following", "nearby"),
        "model.baseline": ("base_model", "first_friction"),
        "model.candidates": ("Term", "candidates", "effect_of", "neutral_values", "way_of"),
        "model.fit": ("fit", "linearise", "refit"),
        "model.friction_field": (
            "CARD",
            "FrictionField",
            "crossed_by",
            "field_along",
            "fields_to_try",
        ),
        "model.gaussian_field": ("ripple_over",),
        "model.model": ("Model", "predict"),
        "model.noise": ("CoordinateNoise", "SessionNoise", "estimate_noise"),
        "model.response": ("MEASURED",),
        "model.sensitivity": ("sensitivities",),
        "model.whitening": ("whiten_throw",),
        "posterior_file": ("can_write_posterior", "write_posterior"),
        "report": ("document", "write_files"),
        "search.maps": ("find_map", "renew_map"),
        "search.patches": ("find_patches",),
        "search.selection": ("fit_with_noise", "misfit_of", "score_candidates", "try_term"),
        "verdict": ("doubts", "remarks", "sentence", "terminal_text"),
    },
)
