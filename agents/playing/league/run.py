"""League for ends: a player meets itself and its past, and learns the value of positions.

Each generation plays ends: it simulates shots before every delivery and throws the one whose
position it values most. A network learns from the scores of these ends and becomes the next
generation. The first generation uses a heuristic. A share of the ends is played against earlier
generations, so that the player still beats them.

The randomness of every batch of ends follows from the run's seed, the generation and the batch, and
the ends of a generation are stored in its file. So a run that was stopped continues from its last
complete generation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from agents.learning.model_file import read_model, write_model
from agents.playing.league.fit import fit_value_network, lessons_of
from agents.playing.league.self_play import (
    Effort,
    PlayedEnds,
    Players,
    end_simulator,
    play_ends,
    score_values,
    sigmas_of,
)
from agents.playing.league.settings import LeagueSettings, league_settings
from agents.playing.league.tuning import LEAD_SPREAD, MAX_ENDS_LEFT, PARALLEL_ENDS
from agents.playing.search.positions import EndSimulator
from agents.playing.search.value_network import ValueNetwork, network_from
from curling_env.errors import InputError
from curling_env.infrastructure.files.writing import keep, make_directory
from curling_env.throw import skill_named
from curling_env.typing import Integers, Progress, no_progress, with_progress


class HeadToHead(NamedTuple):
    """Result of a generation against an opponent.

    Parameters
    ----------
    opponent : number of the opponent's generation; 0 for the heuristic
    ends : number of ends played
    points : points scored minus points conceded, per end
    error : standard error of the points
    """

    opponent: int
    ends: int
    points: float
    error: float


def run_league(
    directory: str | Path,
    settings: LeagueSettings,
    *,
    progress: Progress = no_progress,
    report: Callable[[str], None] = lambda _sentence: None,
) -> ValueNetwork:
    """Play the league, generation after generation, and write each one's file to a folder.

    Existing generations with the same settings are reused. The last one is also written as
    `model.npz`.

    Parameters
    ----------
    directory : folder for the files; made if missing
    settings : settings of the league
    progress : called after each batch of ends and each epoch of learning
    report : called with a sentence for every result against an earlier generation

    Raises
    ------
    InputError : a file in the folder comes from other settings
    OutputError : a file cannot be written
    """
    import torch

    torch.set_num_threads(1)
    folder = make_directory(directory)
    simulator = end_simulator(settings.ice, settings.rules)
    players: list[ValueNetwork | None] = [None]
    experience: list[PlayedEnds] = []
    for number in range(len(settings.generations)):
        path = folder / f"generation-{number + 1}.npz"
        # The heuristic plays worse than all later generations, so its ends are used only once.
        earlier = experience if number > 1 else []
        if path.exists():
            network, fresh = _read_generation(path, settings)
        else:
            fresh, results = _play_generation(simulator, players, settings, number, progress)
            for result in results:
                report(_sentence(number, result))
            torch.manual_seed(settings.seed + number)
            network = fit_value_network(
                simulator.lines,
                [lesson for ends in (*earlier, *fresh) for lesson in lessons_of(ends)],
                np.random.default_rng((settings.seed, number, 2**21)),
                layers=settings.layers,
                epochs=settings.epochs,
                learning_rate=settings.learning_rate,
                progress=progress,
            )
            document = _document(network, settings)
            write_model(path, {**document, "ends": [ends_document(ends) for ends in fresh]})
            keep(f"{number + 1} generations are kept in {folder}; repeat the command to continue")
        players.append(network)
        experience = [*earlier, *fresh]
    newest = players[-1]
    assert newest is not None
    write_model(folder / "model.npz", _document(newest, settings))
    return newest


# --- playing --------------------------------------------------------------------------------------


def _play_generation(
    simulator: EndSimulator,
    players: list[ValueNetwork | None],
    settings: LeagueSettings,
    number: int,
    progress: Progress,
) -> tuple[list[PlayedEnds], list[HeadToHead]]:
    """Return the ends of one generation, and its results against earlier ones."""
    batches = range(-(-settings.generations[number] // PARALLEL_ENDS))
    newest, fresh = len(players) - 1, []
    scored: dict[int, list[Integers]] = {}
    for batch in with_progress(batches, f"generation {number + 1}", progress):
        # Two consecutive batches have the same opponent, once with and once without the hammer.
        draw = np.random.default_rng((settings.seed, number, 2**20 + batch // 2))
        past = newest > 0 and draw.random() < settings.past
        opponent = int(draw.integers(newest)) if past else newest
        rng = np.random.default_rng((settings.seed, number, batch))
        with_hammer = bool(batch % 2)
        first, second = players[newest], players[opponent]
        pair = (first, second) if with_hammer else (second, first)
        ends = _play_batch(simulator, pair, settings, rng)
        fresh.append(ends)
        if past:
            scored.setdefault(opponent, []).append(ends.score if with_hammer else -ends.score)
    results: list[HeadToHead] = []
    for opponent, scores in sorted(scored.items()):
        every = np.concatenate(scores)
        error = float(every.std() / np.sqrt(len(every)))
        results.append(HeadToHead(opponent, len(every), float(every.mean()), error))
    return fresh, results


def _play_batch(
    simulator: EndSimulator, players: Players, settings: LeagueSettings, rng: np.random.Generator
) -> PlayedEnds:
    """Play ends of games with random leads and ends left, by players of the league's skill."""
    left = rng.integers(1, MAX_ENDS_LEFT + 1, PARALLEL_ENDS)
    lead = np.rint(rng.normal(0, LEAD_SPREAD, PARALLEL_ENDS)).astype(int)
    values = score_values(simulator.rules, lead, left)
    sigma = sigmas_of(skill_named(settings.skill))
    return play_ends(simulator, players, values, sigma, rng, effort=Effort(settings.tried))


# --- files ----------------------------------------------------------------------------------------


def _document(network: ValueNetwork, settings: LeagueSettings) -> dict[str, Any]:
    return {"league": asdict(settings), "layers": [list(layer) for layer in network.layers]}


def ends_document(ends: PlayedEnds) -> dict[str, Any]:
    """Return ends in the form of a model file."""
    return {
        "stones": ends.stones,
        "score": ends.score,
        "worth": ends.score_values,
        "skill": ends.skill,
        "earnest": ends.greedy_from,
    }


def ends_from(document: dict[str, Any]) -> PlayedEnds:
    """Read the ends in such a document."""
    names = ("stones", "score", "worth", "skill", "earnest")
    return PlayedEnds(*(document[name] for name in names))


def _read_generation(path: Path, settings: LeagueSettings) -> tuple[ValueNetwork, list[PlayedEnds]]:
    document = read_model(path)
    try:
        saved = league_settings(document["league"])
        ends = [ends_from(played) for played in document["ends"]]
        _check_ends(ends)
    except (KeyError, TypeError, ValueError, InputError) as error:
        raise InputError("is not a generation of a league", source=path) from error
    if saved != settings:
        raise InputError(
            "is from a league with other settings; expected another folder", source=path
        )
    return network_from(document, path), ends


def _check_ends(played: list[PlayedEnds]) -> None:
    """Refuse ends with arrays that do not fit together."""
    for ends in played:
        arrays = [np.asarray(array) for array in ends]
        if any(array.dtype.kind not in "biuf" for array in arrays):
            raise ValueError("expected numbers")
        stones, score, values, skill, greedy_from = arrays
        n = len(score) if score.ndim == 1 else -1
        if stones.ndim != 4 or stones.shape[1:] != (n, 16, 2) or values.shape[:1] != (n,):
            raise ValueError("expected the same number of ends in each array")
        if values.ndim != 2 or any(array.shape not in ((), (n,)) for array in (skill, greedy_from)):
            raise ValueError("expected the same number of ends in each array")


def _sentence(number: int, result: HeadToHead) -> str:
    opponent = f"generation {result.opponent}" if result.opponent else "the heuristic"
    return (
        f"generation {number} against {opponent}: {result.points:+.2f} ± {result.error:.2f} points "
        f"an end in {result.ends} ends"
    )
