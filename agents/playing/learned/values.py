"""Value of every shot of the list in a position, by simulation.

A position's value is the points that the value network of `search` expects of it. The network's
input for a shot is the resulting position after one throw without error; its target is the mean
over throws with execution errors, the better shots more and more often, as `search` throws them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from agents.playing.search.calling_style import FOR_POINTS
from agents.playing.search.evaluator import PositionEvaluator, end_of
from agents.playing.search.ice_error import ice_error
from agents.playing.search.networks import network_for
from agents.playing.search.positions import MAX_POINTS, EndSimulator, position_of
from agents.playing.search.value_network import skill_feature
from curling_env.envs.game.shots import SHOTS, ShotActions
from curling_env.game import PlayerView
from curling_env.ice import Ice
from curling_env.physics.aim import Aim
from curling_env.typing import Floats, Indices, Progress, Singles, no_progress

ROUNDS = ((8, len(SHOTS)), (24, 16), (64, 6))
"""Number of throws of each shot per round, an even number, and number of best shots kept."""


class _Known(NamedTuple):
    """Quantities computed once for an ice, for all positions on it."""

    ice: Ice
    settings: tuple[Any, ...]
    draw_speed: float
    simulator: EndSimulator
    evaluator: PositionEvaluator


class ShotValues:
    """Simulator of shots on the ice as the player knows it; it caches the last ice."""

    def __init__(self) -> None:
        self._shots = ShotActions()
        self._known: _Known | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        # The cache only saves time, and engines hold addresses of this process.
        return ShotValues, ()

    def once(self, views: Sequence[PlayerView]) -> Singles:
        """Return the points of each shot thrown once without error, relative to a throw through the
        house.

        Parameters
        ----------
        views : n positions from the thrower's view

        Returns
        -------
        (n, 201) points; NaN if there is no such shot
        """
        found = np.full((len(views), len(SHOTS)), np.nan, dtype=np.float32)
        for row, view in zip(found, views, strict=True):
            there, throws = self._throws(view)
            row[there] = self._points(view, throws)
            row -= row[-1]
        return found

    def once_and_expected(
        self, views: Sequence[PlayerView], *, progress: Progress = no_progress
    ) -> tuple[Singles, Singles]:
        """Return the result of `once`, and the expected points of each shot with execution errors.

        Parameters
        ----------
        views : n positions from the thrower's view; errors follow from their seeds
        progress : called after every position

        Returns
        -------
        both (n, 201); NaN if there is no such shot
        """
        once = np.full((len(views), len(SHOTS)), np.nan, dtype=np.float32)
        expected = once.copy()
        for k, view in enumerate(views):
            there, throws = self._throws(view)
            once[k, there] = self._points(view, throws)
            expected[k, there] = self._mean_points(view, throws)
            progress("positions", k + 1, len(views))
        return once - once[:, -1:], expected

    def _mean_points(self, view: PlayerView, throws: Floats) -> Floats:
        skill, rng = view.skill, view.rng()
        own = [skill.sigma_speed, skill.sigma_angle, skill.sigma_spin]
        sigma = np.hypot(own, ice_error(view, self._knowledge(view).draw_speed))
        total, count = np.zeros(len(throws)), np.zeros(len(throws))
        chosen = np.arange(len(throws))
        for times, most in ROUNDS:
            mean = total / np.maximum(count, 1)
            chosen = chosen[np.argsort(-mean[chosen], kind="stable")][:most]
            half = skill.standard_errors(times // 2, rng)
            errors = np.concatenate([half, -half]) * sigma
            executed = (throws[chosen][:, None] + errors).reshape(-1, 3)
            total[chosen] += self._points(view, executed).reshape(len(chosen), -1).sum(axis=1)
            count[chosen] += times
        return total / count

    def _throws(self, view: PlayerView) -> tuple[Indices, Floats]:
        """Return the existing shots (m,), and the throw of each (m, 3)."""
        mask = self._shots.mask(view)
        assert mask is not None
        there = np.flatnonzero(mask)
        throws = (self._shots.call_of(shot, view).throw for shot in there.tolist())
        return there, np.array([(one.speed, one.angle, one.spin) for one in throws])

    def _points(self, view: PlayerView, executed: Floats) -> Floats:
        """Return the thrower's points in the positions after throws (m, 3), (m,)."""
        end, known = end_of(view), self._knowledge(view)
        position = position_of(end)
        before = np.broadcast_to(position, (len(executed), *position.shape))
        after = known.simulator.play(before, end.delivered, executed)
        worth = known.evaluator.win_probabilities(view, after, end.delivered + 1)
        return (worth - 0.5) * 2 * MAX_POINTS

    def _knowledge(self, view: PlayerView) -> _Known:
        known, rules, lines = self._known, view.game.rules, view.game.lines
        settings = view.direction, rules, lines, view.delivery, view.skill
        if known is None or known.ice is not view.ice or known.settings != settings:
            simulator = EndSimulator(
                ice=view.ice,
                direction=view.direction,
                rules=rules,
                lines=lines,
                delivery=view.delivery,
            )
            skill = skill_feature(view.skill)
            network = network_for(rules, view.ice)
            evaluator = PositionEvaluator(network, rules, lines, skill, FOR_POINTS)
            speed = Aim(view.ice, view.direction, delivery=view.delivery).draw_weight() or 2.0
            known = self._known = _Known(view.ice, settings, speed, simulator, evaluator)
        return known
