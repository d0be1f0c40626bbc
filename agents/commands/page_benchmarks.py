"""Latency of the app's sheet endpoints on one core, from JSON to JSON."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from agents.app.sheet import games, throws
from agents.app.sheet.forms import CallsForm, GameForm, PlanForm, RunForm, asked
from curling_env.benchmarks.measures import Measure
from curling_env.ice import Ice, load_ice
from curling_env.sheet import TEE_Y
from curling_env.throw import SKILLS

STONES = [
    {"x": 0.3, "y": TEE_Y - 0.2, "team": "home"},
    {"x": -0.5, "y": TEE_Y - 1.0, "team": "away"},
    {"x": 0.1, "y": TEE_Y - 2.8, "team": "away"},
    {"x": -0.2, "y": TEE_Y + 0.9, "team": "home"},
    {"x": 0.9, "y": TEE_Y + 0.4, "team": "away"},
    {"x": -1.1, "y": TEE_Y - 3.3, "team": "home"},
]
TIMES = 5


def page_measures() -> Iterator[Measure]:
    """Measure a throw's path, a planned target, a hit, a call, and an answer in a game."""
    ice, club = _uneven_ice(), SKILLS["club"]
    hands = (club, club)
    position = {"stones": STONES, "delivered": 9, "hammer": "home", "ends_left": 3}
    target = {"x": 0.4, "y": TEE_Y - 0.3}
    throw = {"speed": 2.3, "angle": 0.035, "spin": -1.5}
    run = asked({"ice": "", "throw": throw, "stones": STONES}, RunForm)
    draw = asked({"ice": "", "target": target}, PlanForm)
    hit = {"target": {"x": 0.9, "y": TEE_Y + 0.4}, "stones": STONES, "hit": True}
    takeout = asked({"ice": "", **hit}, PlanForm)
    call = asked({"ice": "", "position": position}, CallsForm)
    answer = {"position": position, "throw": throw, "opponent": "search"}
    game = asked({"ice": "", **answer}, GameForm)
    for name, unit, work in (
        ("page_throw_path_ms", "ms", lambda: throws.run(ice, run)),
        ("page_planned_target_s", "s", lambda: throws.planned(ice, club, draw)),
        ("page_planned_hit_s", "s", lambda: throws.planned(ice, club, takeout)),
        ("page_best_call_s", "s", lambda: games.called(ice, club, call)),
        ("page_search_answers_s", "s", lambda: games.played(ice, hands, game)),
    ):
        yield Measure(name=name, value=_spent(work) * (1000 if unit == "ms" else 1), unit=unit)


def _spent(work: Callable[[], dict[str, Any]]) -> float:
    """Return the processor time of an answer with its JSON, the median of five [s]."""
    spent: list[float] = []
    for _ in range(TIMES + 1):  # warms up
        start = time.process_time()
        json.dumps(work(), allow_nan=False)
        spent.append(time.process_time() - start)
    return float(np.median(spent[1:]))


def _uneven_ice() -> Ice:
    """Return ice like that of an estimate: a map with standard errors."""
    ice = load_ice("standard")
    x, y = np.meshgrid(ice.sheet.x_centres, ice.sheet.y_centres)
    mu = ice.friction.mu * (1 + 0.02 * np.sin(y / 3) * np.cos(x))
    friction = replace(ice.friction, mu=mu, sigma=0.01 * mu, observed=np.abs(x) < 1.6)
    return replace(ice, friction=friction)
