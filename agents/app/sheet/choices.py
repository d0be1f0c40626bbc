"""Ices and hands to choose from, by the names that addresses have."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from agents.app.club import Club, Session
from agents.app.club.club import DISCOVERY, digest_of_file
from agents.app.work.causes import errors_of, sessions_with_causes
from agents.coaching.draw_weight import Centre, centre_of
from curling_env.errors import InputError, placed
from curling_env.ice import Ice, load_ice
from curling_env.infrastructure.files.reading import read_json
from curling_env.throw import Skill, skill_named

if TYPE_CHECKING:
    from agents.coaching import AthleteErrors
    from friction_estimation.reports.missing_in_words import Findings

MADE_UP = {"standard": "Usual championship ice (not measured)"}
"""Presets that are offered beside the sessions' ices."""
HANDS = {
    "elite": "an elite player",
    "champion": "a champion",
    "club": "a club player",
    "none": "no error at all",
}
"""Skills that are offered beside the athletes'."""
ATHLETE = "athlete:"
"""Before the number of an athlete whose measured hand is meant."""
MOST_SESSIONS = 60
MOST_NEW = 6
"""Ices, the latest, that are looked through when someone looks at a season."""
REPORTS = (f"{DISCOVERY}/report.json", "report.json")
"""Places of a discovery's report in the folder of a session."""


def ices_of(club: Club, first: Session | None = None) -> list[tuple[str, str, Ice]]:
    """The ices that there are: key, label and ice; that of a session first, if it has one."""
    sessions = club.sessions()[:MOST_SESSIONS]
    if first is not None:
        sessions = [first, *(session for session in sessions if session.id != first.id)]
    found: list[tuple[str, str, Ice]] = []
    for session in sessions:
        try:
            ice = ice_of(club, session)
        except InputError:
            continue  # a file that is not whole says so on its own page
        if ice is not None:
            found.append((str(session.id), f"{session.name}, {session.day}", ice))
    return found + [(key, label, load_ice(key)) for key, label in MADE_UP.items()]


def ice_of(club: Club, session: Session) -> Ice | None:
    """The ice of a session; None while none was estimated."""
    path = club.ice_of(session)
    return load_ice(path) if path.exists() else None


def centre_of_session(club: Club, session: Session, *, only_kept: bool = False) -> Centre | None:
    """Return draws down the centre line of a session's ice, worked out when the ice came in.

    Parameters
    ----------
    only_kept : return nothing rather than work
    """
    name, digest = f"draws {session.id}", digest_of_file(club.ice_of(session))
    kept, of = club.answer(name, list[Centre]) or ([], "")
    if digest and of != digest and not only_kept:
        centre = centre_of(load_ice(club.ice_of(session)))
        kept, of = [] if centre is None else [centre], digest
        club.keep_answer(name, of, kept)
    return kept[0] if digest and of == digest and kept else None


def season_of(club: Club, session: Session) -> list[tuple[Session, Centre]]:
    """Sessions on the same sheet, the earliest first, each with draws on its ice."""
    same = [one for one in club.sessions() if one.sheet == session.sheet][:MOST_SESSIONS]
    # Those of an earlier version of the program are worked out when their own page is opened.
    found = [
        (one, centre_of_session(club, one, only_kept=k >= MOST_NEW)) for k, one in enumerate(same)
    ]
    return [(one, centre) for one, centre in found[::-1] if centre is not None]


def ice_named(club: Club, key: str) -> Ice:
    """An ice by its key: the number of a session, or a made-up ice.

    Raises
    ------
    InputError : no ice has this key
    """
    if key in MADE_UP:
        return load_ice(key)
    session = (
        club.session(int(key)) if key.isascii() and key.isdecimal() and len(key) < 18 else None
    )
    ice = None if session is None else ice_of(club, session)
    if ice is None:
        raise InputError(f"unknown ice {key[:40]!r}; choose another")
    return ice


def skills_of(club: Club) -> list[tuple[str, str, str]]:
    """The hands that there are: key, label, and right or left."""
    usual = [(key, label, "right") for key, label in HANDS.items()]
    return usual + [(f"{ATHLETE}{one.id}", one.name, one.hand) for one in club.athletes()]


def skill_of(club: Club, key: str) -> Skill:
    """A hand by its key.

    Raises
    ------
    InputError : no hand has this key, or it has too few throws
    ComingError : it is being worked out
    """
    if key in HANDS:
        return skill_named(key)
    name = _athlete_named(club, key)
    if name is None:
        raise InputError(f"unknown athlete or skill {key[:40]!r}; choose another")
    errors = errors_named(club, key)
    if errors is None:
        raise InputError(f"too few throws of {name} with a called target yet")
    return errors.skill


def errors_named(club: Club, key: str) -> AthleteErrors | None:
    """Errors of the athlete with a key; None for other keys, and with too few throws.

    Raises
    ------
    ComingError : it is being worked out
    """
    name = _athlete_named(club, key)
    if name is None:
        return None
    found, _ = errors_of(club, sessions_with_causes(club))
    return next((errors for errors in found if errors.name == name), None)


def _athlete_named(club: Club, key: str) -> str | None:
    return next((one.name for one in club.athletes() if key == f"{ATHLETE}{one.id}"), None)


def findings_of(club: Club, session: Session) -> Findings | None:
    """Return the findings of a discovery in a session; None while there was none.

    Raises
    ------
    InputError : a report that is not one
    """
    for name in REPORTS:
        path = club.folder_of(session) / name
        if path.exists():
            from friction_estimation.reports.missing_in_words import findings

            report: Any = read_json(path)
            with placed(source=path.name):
                return findings(report if isinstance(report, dict) else {})
    return None
