"""A league: ends between generations, their learning, and the file of the player."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from agents.learning import read_model, write_model
from agents.playing import (
    MAX_POINTS,
    SLOTS,
    LeagueSettings,
    PlayedEnds,
    ValueNetwork,
    fit_value_network,
    league_settings,
    play_game,
    player_from,
    points_of,
    run_league,
)
from agents.playing.league.fit import lessons_of
from curling_env.errors import InputError
from curling_env.game import GameSimulator, Lines, player_named, rule_set

TINY = LeagueSettings(generations=(128, 64), tried=8, layers=(32, 16, 48, 24))


@pytest.fixture(scope="module")
def league(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    folder, reports = tmp_path_factory.mktemp("league"), []
    run_league(folder, TINY, report=reports.append)
    return folder, reports


def layers_of(path: Path) -> list[np.ndarray]:
    return [array for layer in read_model(path)["layers"] for array in layer]


def test_a_league_taken_up_again_ends_as_one_that_was_not_stopped(
    league: tuple[Path, list[str]], tmp_path: Path
) -> None:
    folder, _ = league
    first_file = (folder / "generation-1.npz").read_bytes()
    (tmp_path / "generation-1.npz").write_bytes(first_file)
    run_league(tmp_path, TINY)
    for a, b in zip(
        layers_of(folder / "model.npz"), layers_of(tmp_path / "model.npz"), strict=True
    ):
        np.testing.assert_array_equal(a, b)
    first = layers_of(folder / "generation-1.npz")
    assert any(
        (a != b).any() for a, b in zip(first, layers_of(tmp_path / "model.npz"), strict=True)
    )
    with pytest.raises(InputError, match="other settings"):
        run_league(tmp_path, replace(TINY, seed=1))


def test_it_reports_the_result_of_a_generation_against_earlier_ones(tmp_path: Path) -> None:
    reports: list[str] = []
    settings = replace(TINY, generations=(1, 1), past=1.0, epochs=1, tried=6)
    run_league(tmp_path, settings, report=reports.append)
    assert len(reports) == 1
    assert reports[0].startswith("generation 1 against the heuristic: ")


def surprise(network: ValueNetwork, ends: PlayedEnds) -> float:
    """Return minus the log of the predicted probability of the actual scores, over the last third
    of an end.
    """
    score = np.clip(ends.score, -MAX_POINTS, MAX_POINTS) + MAX_POINTS
    predicted = [
        network.score_probabilities(
            Lines(), ends.stones[k].astype(float), 15 - k, ends.score_values, 0.0
        )
        for k in range(10, 15)
    ]
    return -float(np.mean([np.log(s[np.arange(len(score)), score] + 1e-9) for s in predicted]))


def scattered(n: int, rng: np.random.Generator) -> PlayedEnds:
    """Return PlayedEnds of stones at random places that do not move again."""
    stones, seen = np.full((n, SLOTS, 2), np.nan), []
    for delivered in range(SLOTS):
        stones[:, SLOTS // 2 * (1 - delivered % 2) + delivered // 2] = rng.normal(0, 1, (n, 2))
        seen.append(stones.copy())
    score = points_of(Lines(), stones)
    return PlayedEnds(np.array(seen, dtype=np.float32), score, np.zeros((n, 13)))


def taught(ends: PlayedEnds) -> ValueNetwork:
    import torch

    torch.manual_seed(0)
    rng = np.random.default_rng(0)
    return fit_value_network(Lines(), lessons_of(ends), rng, layers=TINY.layers, epochs=12)


def test_positions_predict_the_score_of_ends_better_than_chance() -> None:
    rng = np.random.default_rng(0)
    known, unseen = scattered(512, rng), scattered(256, rng)
    shuffled = known._replace(score=rng.permutation(known.score))
    scores = np.clip(known.score, -MAX_POINTS, MAX_POINTS) + MAX_POINTS
    shares = np.bincount(scores, minlength=2 * MAX_POINTS + 1) / len(scores)
    unseen_scores = np.clip(unseen.score, -MAX_POINTS, MAX_POINTS) + MAX_POINTS
    by_shares = -np.log(shares[unseen_scores] + 1e-3).mean()
    learnt, by_chance = (surprise(taught(ends), unseen) for ends in (known, shuffled))
    assert learnt < by_shares - 0.2, (learnt, by_shares, by_chance)
    assert by_chance > by_shares - 0.05, (learnt, by_shares, by_chance)


def test_the_model_plays_a_game(league: tuple[Path, list[str]]) -> None:
    folder, _ = league
    player = player_from(str(folder / "model.npz"))
    assert player.name == folder.name
    simulator = GameSimulator(
        "standard", rules=rule_set("world_curling_2024", ends=1), skills="elite"
    )
    played = play_game(simulator, (player, player_named("draw")), seed=3)
    assert len(played.deliveries) >= 16
    assert len({delivery.shot.call.shot for delivery in played.deliveries[:16:2]}) > 1


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"generation": 3}, "unknown key 'generation'"),
        ({"generations": []}, "generations must list"),
        ({"layers": [1, 2]}, "layers must be four"),
        ({"past": 2}, "past must be between"),
        ({"tried": 2}, "tried must be a whole number of at least"),
        ({"skill": "god"}, "unknown skill"),
    ],
)
def test_refuses_a_league_that_makes_no_sense(wrong: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        league_settings({"algorithm": "league", **wrong})


def test_refuses_weights_of_another_network(league: tuple[Path, list[str]], tmp_path: Path) -> None:
    document = read_model(league[0] / "model.npz")
    for layers in (document["layers"][:3], [[np.zeros((2, 2)), np.zeros(2)]] * 5, None):
        write_model(tmp_path / "bad.npz", {**document, "layers": layers})
        with pytest.raises(InputError):
            player_from(str(tmp_path / "bad.npz"))
