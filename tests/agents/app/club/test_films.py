"""Films that are sent piece by piece, through killed servers, and films that lie there."""

from __future__ import annotations

import pytest

from agents.app import Club, add_piece, begin_film, films_there, settle_films, take_film
from curling_env.errors import InputError


@pytest.fixture
def session(club):
    return club.add_session("Tuesday", "2026-11-17", "sheet 1", None)


def test_a_film_comes_whole_from_its_pieces(club, session):
    film = begin_film(club, session, "end 1.mp4", 10)
    film = add_piece(club, film, 0, b"abcd")
    assert not film.is_whole
    assert not club.path(film.file).exists()
    film = add_piece(club, film, 4, b"efghij")
    assert film.is_whole
    assert club.path(film.file).read_bytes() == b"abcdefghij"


def test_what_a_killed_server_had_written_and_not_counted_is_written_again(club, session):
    film = begin_film(club, session, "end.mp4", 8)
    film = add_piece(club, film, 0, b"abcd")
    draft = next(club.folder_of(session).glob("films/*.part"))
    draft.write_bytes(b"abcdXX")  # killed within the next piece
    again = Club(club.folder)
    settle_films(again)
    film = begin_film(again, session, "end.mp4", 8)
    assert film.received == 4
    assert add_piece(again, film, 4, b"efgh").is_whole
    assert again.path(film.file).read_bytes() == b"abcdefgh"


@pytest.mark.parametrize("letter", ["é", "冰", "🥌"])
def test_a_long_name_in_any_script_is_cut_to_what_a_disk_takes(club, session, letter):
    film = begin_film(club, session, letter * 190 + ".mp4", 8)
    assert film.name == letter * 190 + ".mp4"
    add_piece(club, film, 0, b"abcd")
    assert add_piece(club, film, 4, b"efgh").is_whole
    path = club.path(film.file)
    assert path.read_bytes() == b"abcdefgh"
    assert path.suffix == ".mp4"
    assert path.name.startswith(f"000-{letter}")


def test_a_film_that_was_complete_when_the_server_was_killed_is_counted(club, session):
    film = begin_film(club, session, "end.mp4", 8)
    add_piece(club, film, 0, b"abcd")
    draft = next(club.folder_of(session).glob("films/*.part"))
    draft.write_bytes(b"abcdefgh")
    draft.replace(club.path(film.file))  # killed between this and the database
    again = Club(club.folder)
    settle_films(again)
    assert again.film(film.id).is_whole


@pytest.mark.parametrize(("begin", "piece"), [(0, b"ab"), (5, b"a"), (4, b"efghi")])
def test_a_piece_that_does_not_follow_is_refused(club, session, begin, piece):
    film = begin_film(club, session, "end.mp4", 8)
    film = add_piece(club, film, 0, b"abcd")
    with pytest.raises(InputError, match="from 4 on"):
        add_piece(club, film, begin, piece)


@pytest.mark.parametrize(
    ("name", "size"),
    [
        *(("end.exe", 5), ("end", 5), ("", 5), ("a\nb.mp4", 5), ("x" * 300 + ".mp4", 5)),
        *(("end.mp4", 0), ("end.mp4", -1), ("end.mp4", 2**50)),
    ],
)
def test_what_is_no_film_is_not_begun(club, session, name, size):
    with pytest.raises(InputError):
        begin_film(club, session, name, size)
    assert club.films(session) == []


@pytest.mark.parametrize("name", ["../../../etc/passwd.mp4", "/etc/x.mp4", "..\\..\\x.mp4"])
def test_a_name_leads_nowhere_else(club, session, name):
    film = begin_film(club, session, name, 3)
    add_piece(club, film, 0, b"abc")
    path = club.path(film.file)
    assert path.parent == club.folder_of(session) / "films"
    assert path.read_bytes() == b"abc"


def test_films_that_lie_in_the_folder_are_taken_once(club, session, tmp_path):
    inside, outside = club.folder / "films" / "a.mp4", tmp_path / "b.mp4"
    for path in (inside, outside):
        path.write_bytes(b"x")
    (club.folder / "films" / "link.mp4").symlink_to(outside)
    assert films_there(club) == ["films/a.mp4"]
    take_film(club, session, inside)
    assert films_there(club) == []
    with pytest.raises(InputError, match="already"):
        take_film(club, session, inside)
    for path in (outside, club.folder / "films" / "link.mp4", club.folder / "club.sqlite"):
        with pytest.raises(InputError):
            take_film(club, session, path)
