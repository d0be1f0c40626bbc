"""The rink's own app: pages for athletes and coaches, in the browser of a laptop at the rink.

- `club`: the club folder, with its database and its files
- `work`: long work in processes beside the server, that survives a restart
- `screens`: one module for each screen; a new one is added to the list in `screens/__init__.py`
- `sheet`: what the pages of the sheet ask, as pure functions
- `gate`: what keeps strangers out
- `pages`: what every screen uses to answer
- `application`: all of it together; `serve` opens it to browsers
"""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "club": ("Club",),
        "sheet.forms": ("CallsForm", "GameForm", "PlanForm", "RunForm", "asked"),
        "take_in": ("is_in",),
    },
)
