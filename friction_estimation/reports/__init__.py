"""Reports for people: figures and pages of an estimate, a comparison and a discovery."""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "discovery_figures": ("residual_pictures",),
        "discovery_page": ("write_report_page",),
        "draw_weight": ("DrawWeight",),
        "estimate_page": ("Still", "headline", "write_report"),
        "html": ("write_page",),
        "keen_and_heavy": ("in_a_sentence", "relative_map", "zones"),
        "missing_in_words": ("findings",),
        "throws_section": (
            "as_text",
            "curl_in_words",
            "handle_of",
            "throw_in_words",
            "throw_rows",
            "write_measures",
        ),
    },
)
