"""The pages say what environments are: spaces, options, parts of the reward, numbers seen."""

from __future__ import annotations

import inspect
import json
import re
from dataclasses import fields
from pathlib import Path

import gymnasium as gym
import pytest
from PIL import Image as Picture
from website import observations

import curling_env
from curling_env.envs import CurlingEndEnv, CurlingSheetEnv, GameRewardParts, RewardParts

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "environments.md").read_text(encoding="utf-8")
PAGES = {
    "CurlingSheet-v0": "curling-sheet.md",
    "CurlingEnd-v0": "curling-end.md",
    "curling_v0": "curling-game.md",
}
SPACES = re.findall(
    r"^\| `(\w[\w-]*)` \| `(\{.*?\})` \| `(.*?)` \| `(.*?)` \|$", PAGE, re.MULTILINE
)


def page(environment: str) -> str:
    return (DOCS / "environments" / PAGES[environment]).read_text(encoding="utf-8")


def section(environment: str, title: str) -> str:
    return page(environment).split(f"\n## {title}\n", 1)[1].split("\n## ", 1)[0]


def first_column(table: str) -> list[str]:
    """Names in the first column of the table under that heading."""
    rows = table.split("|---", 1)[1].split("\n\n", 1)[0].splitlines()[1:]
    return [name for row in rows for name in re.findall(r"`(\w+)`", row.split("|")[1])]


@pytest.mark.parametrize(("name", "settings", "action", "observation"), SPACES)
def test_spaces_are_as_written(name, settings, action, observation):
    given = json.loads(settings)
    if name == "curling_v0":
        pytest.importorskip("pettingzoo")
        env = curling_env.curling_v0.env(**given)
        spaces = env.action_space("home"), env.observation_space("home")
    else:
        env = gym.make(name, **given)
        spaces = env.action_space, env.observation_space
    assert (str(spaces[0]), str(spaces[1])) == (action, observation)


def test_every_environment_is_in_the_table():
    ours = {name for name, spec in gym.registry.items() if "curling_env" in str(spec.entry_point)}
    assert {row[0] for row in SPACES} == ours | {"curling_v0"}


@pytest.mark.parametrize(
    ("title", "made_by"), [("CurlingSheet-v0", CurlingSheetEnv), ("CurlingEnd-v0", CurlingEndEnv)]
)
def test_every_option_is_explained_and_no_other(title, made_by):
    explained = first_column(section(title, "Arguments").split("| option | meaning |", 1)[1])
    assert sorted(explained) == sorted(inspect.signature(made_by).parameters)


def test_every_part_of_the_reward_is_explained():
    explained = first_column(section("CurlingSheet-v0", "Rewards").split("| part | value |", 1)[1])
    assert explained == [part.name for part in fields(RewardParts)]
    text = section("CurlingEnd-v0", "Rewards")
    for part in fields(GameRewardParts):
        assert f"`{part.name}`" in text


@pytest.mark.parametrize("title", PAGES)
def test_a_page_lists_the_spaces(title):
    (named,) = [row[2:] for row in SPACES if row[:2] == (title, "{}")]
    for space, shown in zip(("Action", "Observation"), named, strict=True):
        assert f"| {space} space | `{shown}` |" in page(title)


@pytest.mark.parametrize("title", ["CurlingSheet-v0", "CurlingEnd-v0"])
def test_every_number_of_an_observation_has_a_meaning(title):
    asked, options = re.search(r"```{observation} (\S+)(.*)\n```", page(title)).groups()
    assert asked == title
    names = observations.names_of(asked, options)
    result = list(observations.rows(names))
    assert [first for first, *_ in result] == [0, *(last + 1 for _, last, *_ in result[:-1])]
    assert result[-1][1] == len(names) - 1


def test_pictures_are_there_and_small():
    for title in PAGES:
        names = re.findall(r"!\[.+?\]\(\.\./(.+?)\)", page(title))
        for name, size in zip(names, [(800, 450), *[(480, 270)] * (len(names) - 1)], strict=True):
            assert (DOCS / name).stat().st_size < 250_000
            with Picture.open(DOCS / name) as film:
                assert film.n_frames > 30
                assert film.size == size
