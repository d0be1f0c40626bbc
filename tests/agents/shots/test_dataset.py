"""Real ends as a dataset, and throws that explain shots."""

from dataclasses import replace

import numpy as np
import pytest

from agents.playing.search.positions import position_of
from agents.shots.dataset import (
    PROTOTYPES,
    copy_score,
    episodes_of,
    fit_copy,
    score_of_copy,
)
from agents.shots.inversion import Inversion, is_struck
from agents.shots.table import Shot, read_shots
from curling_env.errors import InputError
from curling_env.game.rules import RestingStone, Team
from curling_env.ice import load_ice
from tests.agents.shots.small_tables import RESTS, SmallTable


@pytest.fixture(scope="module")
def inversion() -> Inversion:
    """Throws on standard ice."""
    return Inversion(load_ice("standard"))


def real(inversion: Inversion, throw: tuple[float, float, float]) -> Shot:
    """Play a known throw among two stones, as a shot of a table."""
    before = (RestingStone(Team.HOME, 0, 0.2, -0.3), RestingStone(Team.AWAY, 0, 0.0, 0.6))
    shot = Shot(
        row=2,
        number=4,
        team=Team.HOME,
        player=1,
        task="takeout",
        spin=np.sign(throw[2]),
        grade=4,
        before=before,
        after=before,
    )
    position = position_of(inversion.end_before(shot))
    after, _ = inversion.simulator.slide(position[None], 4, np.array([throw]))
    stones: list[RestingStone] = []
    for slot, (x, y) in enumerate(after[0].tolist()):
        if x == x:
            # Home throws first, so away has the hammer and the first slots.
            stones.append(RestingStone(Team.AWAY if slot < 8 else Team.HOME, slot % 8, x, y))
    return replace(shot, after=tuple(stones))


@pytest.mark.parametrize(
    "throw", [(2.4, 0.012, -1.5), (2.6, 0.024, -1.5), (2.1, -0.004, -1.5), (2.05, -0.03, 1.5)]
)
def test_a_throw_that_explains_a_shot_leaves_its_stones_where_they_lay(inversion, throw):
    shot = real(inversion, throw)
    found = inversion.throw_of(shot)
    assert found is not None
    assert found.throw.spin == throw[2]
    if not is_struck(shot):
        assert found.misfit == 0
    assert found.misfit < 0.06
    assert found.throw.speed == pytest.approx(throw[0], rel=0.15)


@pytest.fixture
def path(tmp_path):
    """A table of two whole ends, and one that was stopped."""
    small = SmallTable()
    small.end(RESTS, (0, 2))
    small.end(RESTS, (1, 0), hammer=31)
    small.end(RESTS, (0, 1), thrown=9)
    return small.write(tmp_path)


def test_each_whole_end_is_an_episode_of_each_team(path):
    episodes = list(episodes_of(read_shots(path)))
    assert [one.points for one in episodes] == [-2, 2, 1, -1]
    for one in episodes:
        assert one.observations.shape == (6, 180)
        assert one.actions.shape == (5, 3)
        assert np.abs(one.actions).max() <= 1
        assert (one.misfits == 0).all()  # they touch nothing
    # Home delivers first in the first end: it sees the placed stones only, away one more.
    first, second = (one.observations[0] for one in episodes[:2])
    assert first[0] == 0
    assert second[0] == pytest.approx(0.1)
    assert first[2] == -1  # no hammer
    assert episodes[0].observations[-1][0] == 1  # the end is over
    # Handles alternate, and so do the signs of the spin.
    assert (episodes[0].actions[:, 2] * episodes[1].actions[:, 2] < 0).all()


def test_the_command_writes_a_dataset_that_minari_reads(path, tmp_path, curling, monkeypatch):
    minari = pytest.importorskip("minari")
    done = curling("record-games", "--table", path, "-o", tmp_path / "data", "--json")
    document = done.json()
    assert (document["episodes"], document["deliveries"], document["copy"]) == (4, 20, None)
    assert document["explained_within_10_cm"] == 1.0
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "data"))
    dataset = minari.load_dataset("curling/doubles-v0")
    assert dataset.total_episodes == 4
    episodes = list(dataset.iterate_episodes())
    assert sorted(float(np.sum(one.rewards)) for one in episodes) == [-2, -1, 1, 2]
    env = dataset.recover_environment()
    assert env.unwrapped.usual.simulator.rules.name == "mixed_doubles_2024"
    assert env.observation_space.contains(episodes[0].observations[0].astype(np.float32))
    again = curling("record-games", "--table", path, "-o", tmp_path / "data")
    assert "a dataset already exists" in again.complaint


def test_a_table_without_a_whole_end_is_refused(tmp_path, curling):
    small = SmallTable()
    small.end(RESTS, (0, 1), thrown=9)
    path = small.write(tmp_path)
    pytest.importorskip("minari")
    complaint = curling("record-games", "--table", path, "-o", tmp_path / "data").complaint
    assert "Stones.csv: holds no whole end" in complaint


def test_a_copy_throws_what_was_thrown_in_such_positions():
    rng = np.random.default_rng(0)
    seen = rng.uniform(-1, 1, (1500, 5))
    actions = np.where(seen[:, :1] > 0, [[0.5, 0.2, 1.0]], [[-0.5, -0.2, -1.0]])
    actions = actions + 0.02 * rng.standard_normal(actions.shape)
    copy = fit_copy(seen[:1200], actions[:1200], prototypes=4)
    score = score_of_copy(copy, actions[:1200], seen[1200:], actions[1200:])
    assert score.deliveries == 300
    assert score.log_score > score.baseline + 0.4  # ln 2 for knowing which of the two
    clear = seen[1200:][np.abs(seen[1200:, 0]) > 0.3]
    thrown = np.array([copy(one) for one in clear])
    assert (np.sign(thrown[:, 2]) == np.sign(clear[:, 0])).mean() > 0.9


def test_few_deliveries_make_no_copy(path):
    episodes = list(episodes_of(read_shots(path)))
    assert copy_score(episodes) is None
    with pytest.raises(InputError, match=f"a copy needs {PROTOTYPES} deliveries"):
        fit_copy(np.zeros((5, 3)), np.zeros((5, 3)))
