"""The coaching commands, from files to tables, pictures and skills."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
import simulated_club as club

from curling_env.game import load_skill
from curling_env.ice import load_ice, save_ice
from curling_env.infrastructure import read_table, write_table
from curling_env.trajectory import write_tracks


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Ten throws of two athletes with three stones, their ice, and the ice of the morning."""
    folder = tmp_path_factory.mktemp("evening")
    rng = np.random.default_rng(21)
    athletes = (club.Athlete(name="Ada"), club.Athlete(name="Bo/../x", bias=(0.04, 0.0, 0.0)))
    stones = {1: (1.0, 1.0), 2: (1.03, 1.0), 4: (0.97, 1.0)}
    evening = club.evening(rng, athletes=athletes, throws=5, stones=stones, off=0.01, hairs=0.0)
    write_tracks(folder / "tracks.csv", evening.tracks)
    save_ice(evening.ice.as_ice(rng, sigma=0.002), folder / "ice.json")
    save_ice(evening.believed.as_ice(), folder / "morning.json")
    notes = evening.notes
    columns = {
        name: [getattr(note, name) for note in notes.values()]
        for name in ("athlete", "stone", "called")
    }
    write_table(folder / "throws.csv", {"throw": list(notes), **columns})
    return folder


@pytest.fixture
def evening(made, tmp_path):
    return shutil.copytree(made, tmp_path / "evening")


def test_hand_or_ice(evening, curling):
    done = curling(
        "hand-or-ice", evening / "tracks.csv", "--ice", evening / "ice.json",
        "--believed", evening / "morning.json", "-o", evening / "why.csv",
        "--picture", evening / "why.png", "--units", "feet",
    )  # fmt: skip
    found = done.json()
    assert len(found["throws"]) == 10
    assert found["pattern"]["throws"] == 10
    assert "misread ice" in done.err
    assert " ft " in done.err
    table = read_table(evening / "why.csv", required=("throw", "weight_past", "ice_share_sigma"))
    assert table.numbers("weight_past")[0] == pytest.approx(
        found["throws"][0]["weight_past"], abs=1e-4
    )
    assert (evening / "why.png").read_bytes().startswith(b"\x89PNG")


def test_hand_or_ice_without_the_believed_ice(evening, curling):
    done = curling("hand-or-ice", evening / "tracks.csv", "--ice", evening / "ice.json")
    assert not done.json()["believed"]
    assert "was not given" in done.err
    assert "misread ice  " not in done.err


def test_a_session_without_calls_is_refused_with_the_missing_table(evening, curling):
    (evening / "throws.csv").unlink()
    message = curling(
        "hand-or-ice", evening / "tracks.csv", "--ice", evening / "ice.json"
    ).complaint
    assert "no table throws.csv with calls next to these tracks" in message


def test_the_calls_are_not_written_over(evening, curling):
    before = (evening / "throws.csv").read_bytes()
    message = curling(
        "hand-or-ice", evening / "tracks.csv", "--ice", "standard", "-o", evening / "throws.csv"
    ).complaint
    assert "contains the notes of the throws" in message
    assert (evening / "throws.csv").read_bytes() == before


def test_athletes_and_their_skills(evening, curling):
    done = curling(
        "athletes", evening / "tracks.csv", evening / "tracks.csv", "--ice", evening / "ice.json",
        "--believed", evening / "morning.json", "-o", evening / "athletes",
        "--picture", evening / "athletes.png",
    )  # fmt: skip
    ada, bo = done.json()
    assert (ada["athlete"], ada["sessions"], ada["throws"]) == ("Ada", 2, 10)
    assert bo["speed_bias"] > ada["speed_bias"]
    assert "s heavy" in done.err
    names = sorted(path.name for path in (evening / "athletes").iterdir())
    assert names == ["Ada.skill.json", "Bo_x.skill.json", "athlete_errors.csv"]
    skill = load_skill(evening / "athletes" / "Bo_x.skill.json")
    assert skill.name == "Bo/../x"
    assert skill.sigma_speed == pytest.approx(bo["speed_spread"])
    assert (evening / "athletes.png").exists()


def test_as_many_ices_as_sessions(evening, curling):
    tracks = evening / "tracks.csv"
    message = curling("athletes", tracks, tracks, tracks, "--ice", "a", "--ice", "b").complaint
    assert message == "--ice: expected one ice for all sessions, or one for each of the 3, got 2"


def test_match_stones(evening, curling):
    done = curling(
        "match-stones", evening / "tracks.csv", "--ice", evening / "ice.json",
        "-o", evening / "stones.json", "--picture", evening / "stones.png",
    )  # fmt: skip
    found = done.json()
    assert [one["stone"] for one in found["stones"]] == ["4", "1", "2"]
    assert "keener" in done.err
    assert len(found["pairs"]) == 1
    ice = load_ice(evening / "stones.json")
    biases = [e.parameters for e in ice.effects if e.name == "stone_bias"]
    assert {int(one["stone"]) for one in biases} == {1, 2, 4}
    assert ice.provenance["inputs"]
    assert (evening / "stones.png").exists()


def test_stones_without_numbers_are_refused(evening, curling):
    tracks = evening / "tracks.csv"
    (evening / "throws.csv").write_text("throw,athlete\n0,Ada\n", encoding="utf-8")
    lines = tracks.read_text(encoding="utf-8").splitlines()
    column = lines[0].split(",").index("stone")
    rows = [line.split(",") for line in lines[1:]]
    for row in rows:
        row[column] = "0"
    tracks.write_text("\n".join([lines[0], *map(",".join, rows)]) + "\n", encoding="utf-8")
    message = curling("match-stones", tracks, "--ice", evening / "ice.json").complaint
    problem = "expected two or more stones, found 1: enter the stone of each throw in throws.csv"
    assert problem in message


@pytest.mark.parametrize(
    "words",
    [
        ("throws",),
        ("throws", "-o", "table.csv"),
        ("hand-or-ice", "--ice", "standard", "-o", "table.csv"),
        ("compare", "--ice", "standard", "-o", "folder"),
        ("athletes", "--ice", "standard", "-o", "folder"),
        ("match-stones", "--ice", "standard", "-o", "ice.json"),
        ("estimate", "-o", "ice.json"),
        ("discover", "-o", "folder"),
    ],
)
def test_a_link_to_itself_next_to_the_tracks_is_refused_in_one_line(
    evening, curling, tmp_path, monkeypatch, words
):
    (evening / "throws.csv").unlink()
    (evening / "throws.csv").symlink_to("throws.csv")
    monkeypatch.chdir(tmp_path)
    refused = curling(words[0], evening / "tracks.csv", *words[1:]).complaint
    assert "throws.csv: cannot be read: too many levels of symbolic links" in refused
    assert [path.name for path in tmp_path.iterdir()] == ["evening"]
