"""How near to Digital Curling's server shots end: measured transitions against what is played here.

    python scripts/digital_curling_transitions.py transitions.json

Three ways are held to the server: `agents.digital_curling.transition`, which follows its time
steps, and the project's two engines, which follow the law. A file of transitions is JSON, as in
tests/agents/digital_curling/transitions.json: for each shot the stones (team, slot, x, y from the
tee), the move as it is sent, and where these stones and the thrown one lay afterwards (null: out).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from agents.digital_curling import HACK_TO_TEE, SPIN, transition
from curling_env import load_ice
from curling_env.physics import Engine, StoneState, play_batch, play_bounds
from curling_env.sheet import HACK_Y, HOG_LINE_Y, TEE_Y, Direction
from curling_env.throw import Release
from curling_env.typing import Floats

MOVED = 1e-4
"""A stone that is further from its place was moved [m]."""
LAST_BUT_ONE = 14
"""A shot so late that no guard is protected, and that no end is scored after it."""


def by_transition(shot: dict[str, Any]) -> Floats:
    """Places after a shot as the server would send them, (n, 2) from the tee; NaN: out."""
    slots: dict[str, list[Any]] = {"team0": [None] * 8, "team1": [None] * 8}
    for stone in shot["stones"]:
        place = {"x": stone["x"], "y": stone["y"] + HACK_TO_TEE}
        slots[f"team{stone['team']}"][stone["slot"]] = {"angle": 0.0, "position": place}
    state = {
        "end": 0, "shot": LAST_BUT_ONE, "hammer": "team1", "stones": slots,
        "scores": {"team0": [None], "team1": [None]},
    }  # fmt: skip
    after = transition(state, shot["move"], {"max_end": 1})["stones"]
    entries = [after[f"team{stone['team']}"][stone["slot"]] for stone in shot["stones"]]
    return np.array(
        [
            [np.nan] * 2 if entry is None
            else [entry["position"]["x"], entry["position"]["y"] - HACK_TO_TEE]
            for entry in (*entries, after["team0"][LAST_BUT_ONE // 2])
        ]
    )  # fmt: skip


def release_of(shot: dict[str, Any]) -> Release:
    velocity, sign = shot["move"]["velocity"], -1 if shot["move"]["rotation"] == "cw" else 1
    return Release(x=0.0, y=-HACK_Y, vx=velocity["x"], vy=velocity["y"], omega=sign * SPIN)


def lying(shot: dict[str, Any]) -> Floats:
    """The stones before a shot, (n, 2), sheet frame."""
    return np.array([(s["x"], s["y"] + TEE_Y) for s in shot["stones"]]).reshape(-1, 2)


def past_hog_line(places: Floats) -> Floats:
    """Places from the tee without what the server removes at the hog line."""
    places = places - [0.0, TEE_Y]
    places[~(places[:, 1] - 0.145 > HOG_LINE_Y - TEE_Y)] = np.nan
    return places


def by_engine(shot: dict[str, Any]) -> Floats:
    stones = [StoneState(x=x, y=y) for x, y in lying(shot).tolist()]
    outcome = Engine(load_ice("fcv1")).play(release_of(shot), stones)
    places = np.array([(stone.x, stone.y) for stone in outcome.stones])
    places[[status.value.startswith("out") for status in outcome.status]] = np.nan
    return past_hog_line(places)


def by_batch(shot: dict[str, Any]) -> Floats:
    ice = load_ice("fcv1")
    bounds = play_bounds(ice, Direction.AWAY)
    return past_hog_line(
        play_batch(ice, lying(shot)[None], [release_of(shot)], bounds=bounds).xy[0]
    )


PLAYED = {"transition": by_transition, "engine": by_engine, "batch": by_batch}
KINDS = ("nothing struck", "one stone struck", "several struck")


def read_shots(path: Path) -> list[dict[str, Any]]:
    """Return the shots of a file of transitions."""
    return json.loads(path.read_text(encoding="utf-8"))["transitions"]


def compare(
    shots: list[dict[str, Any]], play: Callable[[dict[str, Any]], Floats]
) -> tuple[int, dict[str, list[float]]]:
    """Compare shots with the server.

    Returns
    -------
    number of shots that leave the same stones in play, and the distances of stones that moved from
    where the server has them [mm], by the kind of shot
    """
    off: dict[str, list[float]] = {kind: [] for kind in KINDS}
    alike = 0
    for shot in shots:
        wanted = np.array([[np.nan] * 2 if xy is None else xy for xy in shot["after"]])
        before = np.vstack([lying(shot) - [0.0, TEE_Y], [[np.nan] * 2]])
        moved = ~(np.hypot(*(wanted - before).T) < MOVED)
        found = play(shot)
        alike += np.array_equal(np.isnan(found[:, 0]), np.isnan(wanted[:, 0]))
        apart = 1e3 * np.hypot(*(found - wanted).T)
        off[KINDS[min(int(moved[:-1].sum()), 2)]] += apart[moved & np.isfinite(apart)].tolist()
    return alike, off


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("file", type=Path)
    shots = read_shots(parser.parse_args().file)
    print(f"{'':<34}{'stones':>8}{'median':>9}{'90 %':>9}{'99 %':>9}{'max mm':>9}")
    for name, play in PLAYED.items():
        alike, off = compare(shots, play)
        print(f"{name}: the same stones in play in {alike} of {len(shots)} shots")
        every = [value for values in off.values() for value in values]
        for kind, values in (*off.items(), ("all that moved", every)):
            if values:
                figures = (np.median(values), *np.percentile(values, (90, 99)), max(values))
                text = "".join(f"{figure:9.2f}" for figure in figures)
                print(f"  {kind:<32}{len(values):>8}{text}")


if __name__ == "__main__":
    main()
