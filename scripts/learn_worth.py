"""Teach the player `search` what a position is worth, from ends that it plays against itself.

    python scripts/learn_worth.py -o runs/worth --ends 1000 1500 3000 5000

In each round ends are played with what was learnt in the round before (in the first, with a rule of
thumb), each team after the chances to win from some score of a game; then the network of
`agents.playing.search.worth` learns from the ends of the later rounds how they were scored. Needs
the extra `train` (torch). Prints how often each score was made in level games.
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from tqdm import tqdm

from agents.playing.aiming import SPIN
from agents.playing.search.atlas import Atlas
from agents.playing.search.positions import SLOTS, Sheet, points_of
from agents.playing.search.shots import Shots, shots_for
from agents.playing.search.winning import Winning
from agents.playing.search.worth import (
    FILE,
    MOST,
    POSITION_FEATURES,
    SCORES,
    STONE_FEATURES,
    Network,
    load_network,
    position_features,
    stone_features,
)
from curling_env.executor import executor
from curling_env.ice import load_ice
from curling_env.rules import rule_set
from curling_env.rules.lines import Lines
from curling_env.sheet import Direction
from curling_env.skill import SKILLS
from curling_env.storage import atomic_path, make_directory

SIDE_BY_SIDE = 128
"""Ends played at once."""
TRIED, AGAIN, TIMES = 32, 6, 3
"""Shots tried once for a position; how many of these are tried again, and how often."""
WIDTHS = (48, 32, 96, 64)
"""Of the hidden layers: two for a stone, two for the position."""


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--ends", type=int, nargs="+", default=[1000, 1500, 3000, 5000])
    parser.add_argument("--network", type=Path, help="begin with this one")
    parser.add_argument("--ice", default="standard")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    torch.manual_seed(arguments.seed)
    torch.set_num_threads(1)
    rng = np.random.default_rng(arguments.seed)
    folder = make_directory(arguments.output)
    rules = rule_set("world_curling_2024")
    sheet = Sheet(ice=load_ice(arguments.ice), direction=Direction.AWAY, rules=rules, lines=Lines())
    network = None if arguments.network is None else load_network(arguments.network)
    lived: list[dict] = []
    for number, ends in enumerate(arguments.ends):
        seeds = np.random.SeedSequence((arguments.seed, number)).spawn(-(-ends // SIDE_BY_SIDE))
        with executor(arguments.workers) as workers:
            play = workers.map(partial(play_ends, sheet, network), seeds)
            fresh = list(tqdm(play, f"round {number + 1}", total=len(seeds), unit="batch"))
        known = number > 1 or arguments.network is not None
        lived = [*lived, *fresh] if known else fresh  # but not how the rule of thumb plays
        network = learn(sheet.lines, lived, rng)
        save(folder / FILE, network)
        scores = np.concatenate([b["score"][b["level"]] for b in fresh])
        shares = [round(float((scores == s).mean()), 3) for s in SCORES]
        print(f"round {number + 1}: shares {dict(zip(SCORES.tolist(), shares, strict=True))}")


def play_ends(sheet: Sheet, network: Network | None, seed: np.random.SeedSequence) -> dict:
    """Play ends side by side: positions after each delivery, and how the ends were scored."""
    n, rules, rng = SIDE_BY_SIDE, sheet.rules, np.random.default_rng(seed)
    atlas = Atlas(sheet.ice, sheet.direction)
    skill = np.where(rng.random(n) < 0.6, 0.0, rng.uniform(-0.7, 1.2, n))
    left = rng.integers(1, 9, n)
    lead = np.rint(rng.normal(0, 1.7, n)).astype(int)
    level = rng.random(n) < 0.4
    left[level], lead[level] = rng.integers(3, 9, level.sum()), 0
    winning = Winning(rules)
    games = zip(lead.tolist(), left.tolist(), strict=True)
    worth = np.array([winning.of_scores(*game) for game in games])
    elite = SKILLS["elite"]
    sigma = np.array([elite.sigma_speed, elite.sigma_angle, elite.sigma_spin])
    sigma = sigma * np.exp(skill)[:, None]
    stones = np.full((n, SLOTS, 2), np.nan)
    seen = []
    # Ends begin in a position that players of another kind have left, so that the network knows
    # those too: each team throws at random, at the button, or away, until the end is in earnest.
    earnest = np.where(rng.random(n) < 0.3, 0, rng.integers(0, rules.deliveries, n))
    habits = rng.random((2, n))
    for delivered in range(rules.deliveries):
        shots = shots_for(atlas, sheet, stones, delivered)
        meant = _by_habit(shots, habits[sheet.mover(delivered)], atlas, rng)
        here = np.flatnonzero(earnest <= delivered)
        if len(here):
            shots = _some(shots[np.isin(shots.position, here)], TRIED, rng)
            end = _Moment(sheet, network, stones, delivered, worth, skill)
            first = end.value(shots, rng.standard_normal((len(shots), 3)) * sigma[shots.position])
            best = _best(shots.position, first, AGAIN)
            again = shots[np.repeat(best, TIMES)]
            more = end.value(again, rng.standard_normal((len(again), 3)) * sigma[again.position])
            mean = (first[best] + more.reshape(-1, TIMES).sum(axis=1)) / (TIMES + 1)
            chosen = best[_best(shots.position[best], mean, 1)]
            meant[shots.position[chosen]] = shots.throws[chosen]
        stones = sheet.play(stones, delivered, meant + rng.standard_normal((n, 3)) * sigma)
        seen.append(stones)
    return {
        "stones": np.array(seen, dtype=np.float32),  # (deliveries, n, 16, 2)
        "earnest": earnest,
        "score": points_of(sheet.lines, stones),
        "worth": worth,
        "skill": skill,
        "level": level & (skill == 0) & (earnest == 0),
    }


def _by_habit(
    shots: Shots, habit: np.ndarray, atlas: Atlas, rng: np.random.Generator
) -> np.ndarray:
    """A throw for each position without a thought, (n, 3): any shot, or a draw to the button."""
    # Hits are many in number; a kind is drawn first.
    rank = rng.random(len(shots)) ** np.bincount(shots.kind)[shots.kind]
    any_shot = shots.throws[_best(shots.position, rank, 1)]
    n = len(habit)
    button = atlas.draws(np.zeros(n), np.zeros(n), SPIN)
    draws = rng.random(n) < np.clip(2 * habit - 0.6, 0, 1)
    return np.where(draws[:, None], button, any_shot)


class _Moment(NamedTuple):
    """Positions of ends side by side, before the same delivery of each."""

    sheet: Sheet
    network: Network | None
    stones: np.ndarray
    delivered: int
    worth: np.ndarray
    skill: np.ndarray

    def value(self, shots: Shots, errors: np.ndarray) -> np.ndarray:
        """What each shot with its error leads to, for the team that throws it."""
        at, sheet = shots.position, self.sheet
        after = sheet.play(self.stones[at], self.delivered, shots.throws + errors)
        to_come = sheet.rules.deliveries - self.delivered - 1
        worth = _worth(sheet, self.network, after, to_come, self.worth[at], self.skill[at])
        return worth if sheet.mover(self.delivered) == 0 else -worth


def _worth(sheet, network, after, to_come, worth, skill) -> np.ndarray:
    points = points_of(sheet.lines, after)
    if to_come == 0:
        return worth[np.arange(len(after)), np.clip(points, -MOST, MOST) + MOST]
    if network is not None:
        chances = [
            (network.chances(sheet.lines, after[p], to_come, worth[p], skill[p]) * worth[p]).sum(1)
            for p in np.array_split(np.arange(len(after)), max(len(after) // 512, 1))
        ]
        return np.concatenate(chances)
    # A rule of thumb: what lies counts the more the later, and near stones are worth having.
    near = np.nan_to_num(np.exp(-np.hypot(after[:, :, 0], after[:, :, 1]) / 0.7))
    played = 1 - to_come / sheet.rules.deliveries
    net = near[:, :8].sum(axis=1) - near[:, 8:].sum(axis=1)
    guess = played * points + (1 - 0.5 * played) * net + 0.5 * (1 - played)
    at = np.clip(guess + MOST, 0, 2 * MOST - 1e-9)
    k = at.astype(int)
    rows = np.arange(len(after))
    return worth[rows, k] * (1 - at + k) + worth[rows, k + 1] * (at - k)


def _some(shots: Shots, most: int, rng: np.random.Generator) -> Shots:
    """So many shots for each position, drawn at random."""
    return shots[_best(shots.position, rng.random(len(shots)), most)]


def _best(position: np.ndarray, value: np.ndarray, most: int) -> np.ndarray:
    """Indices of the best `most` of each position."""
    order = np.lexsort((-value, position))
    starts = np.r_[True, np.diff(position[order]) != 0]
    begin = np.maximum.accumulate(np.where(starts, np.arange(len(order)), 0))
    return order[np.arange(len(order)) - begin < most]


# --- learning -------------------------------------------------------------------------------------


def learn(lines: Lines, lived: list[dict], rng: np.random.Generator, epochs: int = 8) -> Network:
    """The network that says best how ends were scored."""
    a, b, c, d = WIDTHS
    stone = torch.nn.Sequential(
        torch.nn.Linear(STONE_FEATURES, a), torch.nn.ReLU(),
        torch.nn.Linear(a, b), torch.nn.ReLU(),
    )  # fmt: skip
    position = torch.nn.Sequential(
        torch.nn.Linear(2 * b + POSITION_FEATURES, c), torch.nn.ReLU(),
        torch.nn.Linear(c, d), torch.nn.ReLU(), torch.nn.Linear(d, len(SCORES)),
    )  # fmt: skip
    parameters = [*stone.parameters(), *position.parameters()]
    rows = []
    for batch in lived:
        deliveries = len(batch["stones"])
        for delivered in range(deliveries - 1):
            for mirror in (1.0, -1.0):
                here = batch["earnest"] <= delivered
                stones = batch["stones"][delivered][here] * [mirror, 1.0]
                seen, which = stone_features(lines, stones)
                whole = position_features(
                    lines,
                    stones,
                    deliveries - 1 - delivered,
                    batch["worth"][here],
                    batch["skill"][here],
                )
                target = np.clip(batch["score"][here], -MOST, MOST) + MOST
                rows.append((seen, which, whole, target))
    held = set(rng.choice(len(lived), max(len(lived) // 12, 1), replace=False).tolist())
    per = len(rows) // len(lived)
    teach = [k for k in range(len(rows)) if k // per not in held]
    test = [k for k in range(len(rows)) if k // per in held]

    def loss_of(chosen: list[int]) -> torch.Tensor:
        seen = torch.from_numpy(np.concatenate([rows[k][0] for k in chosen]))
        offsets = np.cumsum([0, *(len(rows[k][2]) * SLOTS for k in chosen)])
        which = np.concatenate([rows[k][1] + offsets[i] for i, k in enumerate(chosen)])
        whole = torch.from_numpy(np.concatenate([rows[k][2] for k in chosen]))
        target = torch.from_numpy(np.concatenate([rows[k][3] for k in chosen]))
        teams = torch.zeros(2 * len(whole), b).index_add(
            0, torch.from_numpy(which // (SLOTS // 2)), stone(seen)
        )
        logits = position(torch.cat([teams.reshape(len(whole), -1), whole], dim=1))
        return torch.nn.functional.cross_entropy(logits, target)

    group = 8
    steps = epochs * (len(teach) // group)
    optimiser = torch.optim.AdamW(parameters, lr=2e-3, weight_decay=1e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 3e-3, total_steps=steps + 1)
    for epoch in range(epochs):
        order = rng.permutation(teach)
        total = 0.0
        for k in range(len(teach) // group):
            loss = loss_of(order[k * group : (k + 1) * group].tolist())
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
            total += float(loss.detach())
        with torch.no_grad():
            held_out = float(np.mean([float(loss_of([k])) for k in test]))
        print(f"  epoch {epoch + 1}: {total * group / len(teach):.4f}, held out {held_out:.4f}")
    linear = [m for m in (*stone, *position) if isinstance(m, torch.nn.Linear)]
    return Network(
        layers=tuple(
            (m.weight.detach().numpy().T.copy(), m.bias.detach().numpy().copy()) for m in linear
        )
    )


def save(path: Path, network: Network) -> None:
    """Write the network's arrays, half precision: it is a small file of the package."""
    arrays = {}
    for k, (weights, offset) in enumerate(network.layers):
        arrays[f"weights_{k}"] = weights.astype(np.float16)
        arrays[f"offset_{k}"] = offset.astype(np.float16)
    with atomic_path(path) as draft, draft.open("wb") as file:
        np.savez_compressed(file, **arrays)


if __name__ == "__main__":
    main()
