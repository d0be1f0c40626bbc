"""The versions of the club's database: what each changes in the one before.

A version that was released is never edited; a change is a further one.
"""

from __future__ import annotations

_FIRST = (
    "create table setting (name text primary key, value text not null) strict",
    """create table athlete (
        id integer primary key, name text not null unique,
        hand text not null default 'right' check (hand in ('right', 'left'))) strict""",
    "create table stone (id integer primary key, name text not null unique) strict",
    """create table camera (
        id integer primary key, name text not null unique, length real not null,
        width real not null, scene text) strict""",
    """create table session (
        id integer primary key, name text not null, day text not null, sheet text not null,
        camera_id integer references camera (id), folder text not null unique,
        stale integer not null default 1) strict""",
    """create table film (
        id integer primary key, session_id integer not null references session (id),
        place integer not null, name text not null, file text not null,
        size integer not null, received integer not null default 0,
        state text not null default 'waiting', said text not null default '',
        clock real, unique (session_id, place)) strict""",
    """create table throw (
        id integer primary key, session_id integer not null references session (id),
        number integer not null, film_id integer references film (id), part integer not null,
        clock real not null default 0, seen_stone integer not null default 0,
        athlete_id integer references athlete (id), stone_id integer references stone (id),
        called text not null default '', made integer, note text not null default '',
        unique (session_id, film_id, part)) strict""",
    """create table target (
        id integer primary key, name text not null unique, x real not null, y real not null)
        strict""",
    """create table note (
        id integer primary key, session_id integer not null references session (id),
        text text not null, written text not null) strict""",
    """create table job (
        id integer primary key, kind text not null,
        session_id integer not null references session (id),
        state text not null default 'waiting', share real not null default 0,
        says text not null default '', left real, problem text,
        given text not null default '') strict""",
)

_SECOND = tuple(
    f"alter table {table} add column removed text"
    for table in ("session", "film", "throw", "target")
)

_THIRD = ("alter table film add column camera_id integer references camera (id)",)

_FOURTH = (
    "alter table throw add column settled integer not null default 1",
    "alter table throw add column measures blob",
    "alter table throw add column measured_of text not null default ''",
    "alter table film add column marks text",
    "alter table session add column ice_of text",
    # Numbers of what is removed are not reserved yet.
    """update throw set settled = 0 where removed is not null
        or film_id in (select id from film where removed is not null)""",
)

_FIFTH = (
    *(
        f"alter table session add column {name} text not null default ''"
        for name in ("lineup", "drill", "pebble", "temperature", "humidity", "scrape", "draws")
    ),
    "alter table session add column live blob",
    "alter table session add column live_rests integer not null default 0",
    "alter table session add column live_film integer not null default 0",
    "alter table throw add column swept text not null default ''",
    """create table answer (
        name text primary key, of text not null, content blob not null) strict""",
    """create table position (
        id integer primary key, name text not null unique, address text not null) strict""",
)

VERSIONS = (_FIRST, _SECOND, _THIRD, _FOURTH, _FIFTH)
"""The statements of each version, oldest first."""
