"""Demo: hidden ice, filmed throws on it, an estimate of the ice from them, and better throws.

- `demo`, `demo_findings`: the whole loop and its results; `curling demo` runs it
- `demo_figures`, `demo_page`: its pictures and its page
- `patches`, `practice`, `filming`: the ice, the practice throws, and their films
"""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "demo": ("find_missing_effect", "run_demo"),
        "patches": ("patchy_ice",),
        "practice": ("draw_practice",),
    },
)
