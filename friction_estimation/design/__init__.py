"""Planning of a session: the achievable precision of friction, and informative throws."""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "cramer_rao": ("throw_response", "uniform_bound"),
        "design": (
            *("Design", "Informative", "ThrowKind"),
            *(
                "covariance_after",
                "design_throws",
                "draw_speeds",
                "first_of_best",
                "variance_removed",
            ),
        ),
    },
)
