"""`CurlingSheet-v0`: one throw a step at a task, on a sheet that may hold stones."""

from __future__ import annotations

import numpy as np

from curling_env.envs.sheet.core import SheetCore, Sheets
from curling_env.envs.sheet.rendering import SheetRenderer, Shown
from curling_env.envs.single import SingleEnv
from curling_env.ice import Ice
from curling_env.physics.engine import StoneState
from curling_env.sheet import Direction
from curling_env.typing import Floats, Singles


class CurlingSheetEnv(SheetCore, SingleEnv[Sheets]):
    """Environment of throws for a task, by default a draw to the button.

    Parameters
    ----------
    ice : the ice thrown on: an `Ice`, a file or a preset. May be set between episodes
    known_ice : the ice as the agent knows it; the ice thrown on by default. With an estimated ice
        here and the true one in `ice`, an agent is tested on what it could not know
    ices : ices of which every episode draws its own, and what is known of each, instead of `ice`: a
        list, a folder, the fields of `RandomIces`, a distribution or a function; see `ices`
    ice_sigma : whether every episode is thrown on another ice, drawn from those that the standard
        errors of `ice` allow. What is known stays as it is
    skill : player whose execution error is added to the throws: a name, a `Skill`, or its fields
    task : "draw", "guard", "takeout", "hit_and_stay", "peel", "freeze", the name of a task that a
        package declares, ``module:Class``, or a `Task`; see `tasks`
    throws : number of throws in an episode; stones in play stay where they rest. A task with a
        target stone has one throw
    target : the task's goal, (x, y) in the delivery frame [m], (0, 0) being the button: where a
        draw or a guard should rest, or where the target stone lies; "random" for anywhere the task
        may be set; None for the task's own
    stones : other stones on the sheet before the first throw: positions (k, 2) in the delivery
        frame [m], or how many to lay at random
    direction : the end played to: "away", "home" or "random"
    delivery : where throws begin: "hog-line", "tee-line", "hack" or a `Delivery`
    level : difficulty of the positions, 0 to 1: goals spread from the task's easiest goal to
        anywhere, and up to that share of `stones` lie on the sheet. None for positions as asked
        for. May be set between episodes
    throw_range : the throws that actions choose from, or the fields of a `ThrowRange`; by default
        chosen for the known ice, or for those of `ices` together
    weights : weights of the parts of the reward, or those that differ; by default the task's own
    fps : samples a second of the trajectory in `info`
    details : whether `info` has `throw`, `trajectory` and `outcome` as well
    render_mode : "rgb_array", "rgb_array_list" (pictures of a film of what happened), "human" (a
        window; needs the extra `viewer`) or None

    Raises
    ------
    InputError : an invalid option

    Notes
    -----
    ``reset(options=…)`` takes `target`, `stones`, `direction`, `level`, `ice` and `known_ice` for
    one episode.

    ``step`` leaves in `info`: `status`, `distance_m`, `in_house`, `success`, `reward_…` (the parts
    of the reward), `target` (sheet frame), `target_from_tee` (delivery frame, as the option) and
    `direction`. With `details` the parts are in `reward_parts`, and there are also `throw` (as it
    left the hand), `trajectory` (of the delivered stone) and `outcome` (of every stone).
    `observation.names` names every number of an observation.
    """

    title = "CurlingSheet-v0"

    @property
    def thrown_ice(self) -> Ice:
        """Ice of this episode."""
        return self._episodes.surfaces[0].ice

    @property
    def known_ice(self) -> Ice:
        """Known ice of this episode."""
        return self._episodes.surfaces[0].known.ice

    @property
    def target(self) -> Floats:
        """Target of the delivered stone in this episode, (2,) delivery frame [m]."""
        return self._episodes.target[0].copy()

    @property
    def direction(self) -> Direction:
        """End played to in this episode."""
        return Direction(int(self._episodes.direction[0]))

    @property
    def places(self) -> Floats:
        """Positions of the stones, the task's target stone first, (k, 2) sheet frame [m]."""
        places = self._episodes.stones[0, :, :2]
        return places[~np.isnan(places[:, 0])]

    def ice_features(self, direction: Direction) -> Singles:
        """Return the known ice features, towards an end; see `KnownIce.features`."""
        return self._episodes.surfaces[0].features(direction)

    # --- the parts -----------------------------------------------------------------------------

    def _renderer(self) -> SheetRenderer:
        return SheetRenderer()

    def _clips(self) -> list[Shown]:
        before, info = self._last
        return [
            Shown(
                ice=self.thrown_ice,
                task=self.task.name,
                direction=self.direction,
                target=self.target,
                before=self._lying(before),
                stones=self._lying(self._episodes),
                throw_number=max(int(self._episodes.played[0]), 1),
                throws=self.throws,
                last=info,
            )
        ]

    def _lying(self, sheets: Sheets) -> tuple[StoneState, ...]:
        return tuple(
            StoneState(x=x, y=y, theta=theta, stone=identifier)
            for identifier, (x, y, theta) in zip(
                self._identifiers, sheets.stones[0].tolist(), strict=True
            )
            if x == x  # not NaN
        )
