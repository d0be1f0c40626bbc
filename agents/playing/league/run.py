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

from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from agents.learning.model_file import read_model, write_model
from agents.playing.league.fit import (
    fit_value_network,
    lessons_of,
    negative_log_likelihood,
    shares_error,
)
from agents.playing.league.self_play import (
    Effort,
    ExploratoryPrefix,
    PlayedEnds,
    Players,
    end_simulator,
    play_ends,
    score_values,
    sigmas_of,
)
from agents.playing.league.settings import LeagueSettings, league_settings
from agents.playing.league.tuning import LEAD_SPREAD, MAX_ENDS_LEFT, PARALLEL_ENDS
from agents.playing.search.networks import network_named
from agents.playing.search.value_network import ValueNetwork, network_from, skill_feature
from curling_env.errors import InputError
from curling_env.game.rules.lines import Lines
from curling_env.infrastructure.executor import executor
from curling_env.infrastructure.files.writing import keep, make_directory
from curling_env.throw import skill_named
from curling_env.typing import Integers, Progress, no_progress, with_progress

HELD_OUT = 12
"""Interval of batches of ends that no network learns from."""


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
    workers: int | str = 1,
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
    workers : workers that play the ends, see `executor`
    progress : called after each batch of ends and each epoch of learning
    report : called with a sentence for every result against an earlier generation, and for the
        errors of a generation of a dozen batches or more on ends that were held out

    Raises
    ------
    InputError : a file in the folder comes from other settings
    OutputError : a file cannot be written
    """
    import torch

    torch.set_num_threads(1)
    folder = make_directory(directory)
    lines = end_simulator(settings.ice, settings.rules, settings.delivery).lines
    begin = None if settings.begin is None else network_named(settings.begin)
    players: list[ValueNetwork | None] = [begin]
    experience: list[PlayedEnds] = []
    for number in range(len(settings.generations)):
        path = folder / f"generation-{number + 1}.npz"
        # The heuristic plays worse than all later generations, so its ends are used only once.
        earlier = experience if number > 1 or begin is not None else []
        if path.exists():
            network, fresh = _read_generation(path, settings)
        else:
            fresh, results = _play_generation(players, settings, number, workers, progress)
            for result in results:
                report(_sentence(number, result))
            torch.manual_seed(settings.seed + number)
            network = fit_value_network(
                lines,
                [lesson for ends in (*earlier, *taught(fresh)) for lesson in lessons_of(ends)],
                np.random.default_rng((settings.seed, number, 2**21)),
                layers=settings.layers,
                epochs=settings.epochs,
                learning_rate=settings.learning_rate,
                begin=begin,
                progress=progress,
            )
            if held := held_out(fresh):
                report(errors_in_words(lines, held, network, begin))
            document = _document(network, settings)
            write_model(path, {**document, "ends": [ends_document(ends) for ends in fresh]})
            keep(f"{number + 1} generations are kept in {folder}; repeat the command to continue")
        players.append(network)
        experience = [*earlier, *taught(fresh)]
    newest = players[-1]
    assert newest is not None
    write_model(folder / "model.npz", _document(newest, settings))
    return newest


# --- playing --------------------------------------------------------------------------------------


def _play_generation(
    players: list[ValueNetwork | None],
    settings: LeagueSettings,
    number: int,
    workers: int | str,
    progress: Progress,
) -> tuple[list[PlayedEnds], list[HeadToHead]]:
    """Return the ends of one generation, and its results against earlier ones."""
    batches = range(-(-settings.generations[number] // PARALLEL_ENDS))
    newest, fresh = len(players) - 1, list[PlayedEnds]()
    # Two consecutive batches have the same opponent, once with and once without the hammer.
    draws = [np.random.default_rng((settings.seed, number, 2**20 + k // 2)) for k in batches]
    past = [newest > 0 and draw.random() < settings.past for draw in draws]
    opponents = [
        int(draw.integers(newest)) if met else newest for draw, met in zip(draws, past, strict=True)
    ]
    own = players[newest]
    pairs = [
        (own, players[other]) if batch % 2 else (players[other], own)
        for batch, other in zip(batches, opponents, strict=True)
    ]
    seeds = [(settings.seed, number, batch) for batch in batches]
    scored: dict[int, list[Integers]] = {}
    with executor(workers) as crew:
        played = crew.map(partial(_play, settings), list(zip(pairs, seeds, strict=True)))
        watched = with_progress(batches, f"generation {number + 1}", progress)
        for batch, ends in zip(watched, played, strict=True):
            fresh.append(ends)
            if past[batch]:
                scored.setdefault(opponents[batch], []).append(
                    ends.score if batch % 2 else -ends.score
                )
    results: list[HeadToHead] = []
    for opponent, scores in sorted(scored.items()):
        every = np.concatenate(scores)
        error = float(every.std() / np.sqrt(len(every)))
        results.append(HeadToHead(opponent, len(every), float(every.mean()), error))
    return fresh, results


def _play(settings: LeagueSettings, batch: tuple[Players, tuple[int, ...]]) -> PlayedEnds:
    return played_batch(settings, *batch)


def played_batch(settings: LeagueSettings, players: Players, seed: tuple[int, ...]) -> PlayedEnds:
    """Play ends of games with random leads and ends left.

    Parameters
    ----------
    settings : ice, rules and players of the league
    players : networks of the team with the hammer and of its opponent; None for the heuristic
    seed : seed of everything random
    """
    n, rng, usual = PARALLEL_ENDS, np.random.default_rng(seed), skill_named(settings.skill)
    simulator = end_simulator(settings.ice, settings.rules, settings.delivery)
    other = np.zeros(n)
    if settings.various:
        other = np.where(rng.random(n) < 0.6, 0.0, rng.uniform(-0.7, 1.2, n))
    left = rng.integers(1, MAX_ENDS_LEFT + 1, n)
    lead = np.rint(rng.normal(0, LEAD_SPREAD, n)).astype(int)
    effort = Effort(settings.tried)
    if not settings.various:
        values = score_values(simulator.rules, lead, left)
        return play_ends(simulator, players, values, sigmas_of(usual), rng, effort=effort)
    level = rng.random(n) < 0.4
    left[level], lead[level] = rng.integers(3, MAX_ENDS_LEFT + 1, level.sum()), 0
    values = score_values(simulator.rules, lead, left)
    # Most ends begin with random throws, so that the network also learns positions that players of
    # another kind leave.
    until = np.where(rng.random(n) < 0.3, 0, rng.integers(0, simulator.rules.deliveries, n))
    prefix = ExploratoryPrefix(until, rng.random((2, n)))
    sigma, skill = sigmas_of(usual) * np.exp(other)[:, None], skill_feature(usual) + other
    return play_ends(
        simulator, players, values, sigma, rng, effort=effort, skill=skill, prefix=prefix
    )


def held_out(batches: Sequence[PlayedEnds]) -> list[PlayedEnds]:
    """Return the batches of a generation that no network learns from."""
    return list(batches[HELD_OUT - 1 :: HELD_OUT])


def taught(batches: Sequence[PlayedEnds]) -> list[PlayedEnds]:
    """Return the batches to learn from."""
    return [ends for k, ends in enumerate(batches, start=1) if k % HELD_OUT]


def errors_in_words(
    lines: Lines, held: list[PlayedEnds], network: ValueNetwork, begin: ValueNetwork | None
) -> str:
    """Return the errors of networks on ends that were held out, beside their shares alone."""
    scores = np.concatenate([played.score for played in held])
    ours = np.array([negative_log_likelihood(network, lines, played) for played in held])
    errors = [f"this network {ours.mean():.4f}", f"shares alone {shares_error(scores):.4f}"]
    if begin is not None:
        other = np.array([negative_log_likelihood(begin, lines, played) for played in held])
        error = (other - ours).std(ddof=1) / len(ours) ** 0.5 if len(ours) > 1 else np.nan
        errors.append(
            f"the one to begin with {other.mean():.4f}, worse by {(other - ours).mean():.4f} "
            f"± {error:.4f}"
        )
    return f"−ln p of the score of {len(scores)} held-out ends: {', '.join(errors)}"


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
