"""The made-up evening: made by one path, measured by another."""

from __future__ import annotations

from dataclasses import replace

from agents.app import Hand, take_in
from agents.app.views.throws import sheets_of
from agents.closed_loop import made_up_evening as made
from curling_env.ice import load_ice


def test_a_made_up_evening_fills_every_table(club, monkeypatch):
    monkeypatch.setattr(made, "THROWS", 9)
    monkeypatch.setattr(made, "FILMED", 1)
    monkeypatch.setattr(made, "FPS", 10.0)
    monkeypatch.setattr(made, "FILM", replace(made.FILM, size=(320, 180), fps=4.0))
    begun = take_in.begin_evening(club, "2026-11-20")
    assert take_in.begin_evening(club, "2026-11-20") is None  # once is enough
    session = take_in.fill_evening(club, begun)
    assert {one.name: one.hand for one in club.athletes()} == {
        "Anna": Hand.RIGHT,
        "Ben": Hand.LEFT,
        "Clara": Hand.RIGHT,
    }
    assert [one.name for one in club.stones()] == [f"red {k}" for k in range(1, 9)]
    (film,) = club.films(session)
    assert film.is_whole
    assert club.path(film.file).stat().st_size == film.size
    sheets = sheets_of(club, session)
    assert len(sheets) == len(club.throws(session)) == 9
    for sheet in sheets:
        assert sheet.call is not None
        assert sheet.handle == sheet.call.handle  # as it was called, by the athlete's hand
        assert abs(sheet.off_broom.value) < 0.8
    assert load_ice(club.ice_of(session)).friction.mu.shape == (89, 9)
