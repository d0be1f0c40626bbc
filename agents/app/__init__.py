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
        "club.films": ("add_piece", "begin_film", "films_there", "settle_films", "take_film"),
        "club.records": ("Hand", "State"),
        "club.removal": (
            "bring_back",
            "delete_for_good",
            "remove",
            "removed_in",
            "removed_sessions",
        ),
        "club.session_files": ("Part", "finish_files", "keep_part", "write_files"),
        "club.targets": ("keep_target", "remove_target", "with_places"),
        "gate": ("token_for",),
        "screens": ("SCREENS",),
        "sheet.forms": ("CallsForm", "GameForm", "PlanForm", "RunForm", "asked"),
        "sheet.games": ("advised", "called", "played"),
        "sheet.ice_sheet": ("EarlierIce", "change_of_maps", "ice_document"),
        "sheet.throws": ("planned", "run"),
        "take_in": ("is_in",),
        "work.queue": ("WorkQueue",),
        "work.jobs": ("cancel", "do_job", "jobs", "submit"),
    },
)
