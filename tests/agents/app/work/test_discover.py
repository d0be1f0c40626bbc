"""Discovery as work beside the server: its report is what the ice page shows."""

from __future__ import annotations

from dataclasses import replace

import pytest

from agents.app.sheet.choices import findings_of
from agents.app.work.jobs import do
from curling_env import Throw, load_ice, write_tracks
from curling_env.errors import InputError
from curling_env.physics import slide


def test_what_discovery_says_of_a_session_is_found_by_its_page(club, visitor, rng):
    session = club.add_session("Short", "2026-11-22", "B", None)
    assert findings_of(club, session) is None
    tracks = []
    for k in range(3):
        throw = Throw(speed=1.3 + 0.2 * k, spin=1.0 - 2.0 * (k % 2))
        path = slide(load_ice("paper"), throw.release(), fps=10.0).trajectory
        seen = path.xy + 0.002 * rng.standard_normal(path.xy.shape)
        tracks.append(replace(path, throw=k, clock=60.0 * k, xy=seen))
    write_tracks(club.tracks_of(session), tracks)
    do("discover", club, session, lambda *_: None, "")
    found = findings_of(club, session)
    assert found is not None
    assert found.verdict.startswith("No effect is named: 3 throws slide freely")
    assert not found.missing
    assert found.next_throws


def test_only_sessions_with_throws_can_be_looked_at(club):
    session = club.add_session("Empty", "2026-11-22", "B", None)
    with pytest.raises(InputError, match="tracks"):
        do("discover", club, session, lambda *_: None, "")
