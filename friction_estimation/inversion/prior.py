"""What is believed of an ice before it is measured: friction varies smoothly over the sheet.

ln μ is a constant of which nothing is known, plus a Matérn field whose spread and length the data
choose by their evidence (marginal likelihood), plus, if throws scatter, an offset per throw whose
spread is chosen the same way. Where the camera errs by a smooth ripple along the sheet
(camera_bias.py), that is one more field, in metres, of its own amplitude and length.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, eigh, solve_triangular
from scipy.optimize import minimize

from curling_env.sheet import Sheet
from curling_env.typing import Floats
from friction_estimation.inversion.matern import matern
from friction_estimation.inversion.throw.camera_bias import (
    LONGEST_RIPPLE,
    SHORTEST_RIPPLE,
    USUAL_RIPPLE,
    USUAL_RIPPLE_LENGTH,
    ripple_root,
)

LEVEL_SPREAD = 1.0
"""Spread of the constant part of ln μ: a factor e either way, which is next to nothing known."""
USUAL_SPREAD, USUAL_LENGTH = 0.04, 3.0
"""Centres of the weak preferences: spatial variation of 2–5 % at 1–3 m (physics, section 4; low
confidence, hence a factor e [spread] and 2 [length] either way)."""
SPREAD_FREEDOM, LENGTH_FREEDOM = 1.0, 0.7
USUAL_SCATTER = 0.003
"""Scale of the half-Cauchy belief in the throw-to-throw spread of ln μ."""
SMOOTHNESS = (1.5, 2.5, np.inf)
"""Orders of Matérn fields that the evidence may choose from: of rough to of perfect slopes."""
FEW_THROWS = 6
"""Fewer cannot tell how smooth an ice is; taking the smoothest for granted would make σ small."""
LEAST_INFORMATION, CLEAR_INFORMATION = 0.5, 10.0
"""Directions of ln μ of which the data know less than this (1/variance) are left out: at a spread
of 0.1 they would tell 0.5 % of what is unknown. The second number serves for a first look."""

EFFECT_SPREAD = 0.1
"""A prior standard deviation of an effect's parameter is put on the scale of ln μ by this."""
RIPPLE_UNIT = 0.1
"""And so is a metre of the camera's ripple: 10 mm of it are as usual as a tenth of μ."""


@dataclass(frozen=True, kw_only=True)
class Belief:
    """Hyperparameters of the prior.

    Parameters
    ----------
    spread : standard deviation of ln μ over the sheet
    length : over which it is alike [m]
    scatter : standard deviation of ln μ from throw to throw
    smoothness : of the field, a Matérn order of `SMOOTHNESS`
    ripple, ripple_length : standard deviation of the camera's displacement along the sheet, and
        over which it is alike [m]; none where 0
    """

    spread: float
    length: float
    scatter: float
    smoothness: float = 2.5
    ripple: float = 0.0
    ripple_length: float = USUAL_RIPPLE_LENGTH


@dataclass(frozen=True, kw_only=True)
class Posterior:
    """Estimate of ln μ relative to the reference.

    Parameters
    ----------
    field : (cells,) mean, and `field_sigma` its standard error
    offsets : (throws,) of each throw
    level, level_sigma : mean of the field over the cells asked for, and its standard error
    resolved : number of independent numbers that the data determine
    belief : the prior that was used
    effects, effects_sigma : (p,) free parameters of effects and their standard errors, in prior
        standard deviations
    ripple, ripple_sigma : (n,) displacement by the camera at the nodes, and its standard error [m]
    """

    field: Floats
    field_sigma: Floats
    offsets: Floats
    level: float
    level_sigma: float
    resolved: float
    belief: Belief
    effects: Floats
    effects_sigma: Floats
    ripple: Floats
    ripple_sigma: Floats


class Evidence:
    """Linear knowledge of ln μ from all throws, release states already projected out.

    Parameters
    ----------
    information : (size, size) Gram matrix of the sensitivities to the m cells that were crossed,
        then to each throw's offset, then to p free parameters of effects in prior standard
        deviations, then to the camera's ripple at n nodes [m]
    pull : (size,) sensitivities times residuals, with the present estimate added back
    crossed : (m,) flat indices of the cells
    sheet : whose cells they are
    ground : (cells,) about which the field is believed to vary; zero where None
    known : (cells,) relative standard error that an earlier ice gives each cell; what has changed
        since then comes on top of it. None where nothing is known.
    effects : p
    nodes : (n,) of the ripple along the sheet [m]; none where None
    asked : sum of squares of the whitened rows with the present estimate added back, plus 2·ln of
        the volume of their noise: makes evidences under different noise comparable
    """

    def __init__(
        self,
        information: Floats,
        pull: Floats,
        crossed: NDArray[np.intp],
        sheet: Sheet,
        *,
        ground: Floats | None = None,
        known: Floats | None = None,
        effects: int = 0,
        nodes: Floats | None = None,
        asked: float = 0.0,
    ) -> None:
        nothing = np.zeros(sheet.shape[0] * sheet.shape[1])
        self.information, self.pull, self.cells = information, pull, crossed
        self.ground = nothing if ground is None else ground
        self.earlier = nothing if known is None else known
        self.own = self.earlier[crossed]
        self.m = len(crossed)
        self.nodes = np.empty(0) if nodes is None else nodes
        self.throws = len(pull) - self.m - effects - len(self.nodes)
        self.sheet = sheet
        columns = sheet.shape[1]
        x = sheet.x_centres[np.arange(sheet.shape[0] * columns) % columns]
        y = sheet.y_centres[np.arange(sheet.shape[0] * columns) // columns]
        self.centres = np.column_stack([x, y])
        own = self.centres[crossed]
        self.between = np.hypot(*(own[:, None] - own[None]).transpose(2, 0, 1))
        self.to_all = np.hypot(*(self.centres[:, None] - own[None]).transpose(2, 0, 1))
        # In units in which all that is free is as little known as the friction of a cell.
        acting = slice(self.m + self.throws, self.m + self.throws + effects)
        unit = np.ones(len(pull))
        unit[acting] = 1.0 / EFFECT_SPREAD
        unit[acting.stop :] = RIPPLE_UNIT
        values, vectors = eigh(information * np.outer(unit, unit))
        told = values > LEAST_INFORMATION
        root = np.sqrt(values[told])
        self.clear = int((values[told] <= CLEAR_INFORMATION).sum())
        beyond = unit * (pull - information[:, : self.m] @ self.ground[crossed])
        self.data = (vectors[:, told].T @ beyond) / root
        self.compress = vectors[:, told].T * unit / root[:, None]
        based = self.ground[crossed]
        asked -= float(based @ (2 * pull[: self.m] - information[: self.m, : self.m] @ based))
        self.constant = asked - float(self.data @ self.data)
        self.rows = root[:, None] * vectors[:, told].T
        self.level = self.rows[:, : self.m].sum(axis=1)
        offsets = self.rows[:, self.m : self.m + self.throws]
        self.offset_square = offsets @ offsets.T
        self.effects = EFFECT_SPREAD * self.rows[:, acting]
        self.ripple = self.rows[:, acting.stop :] / RIPPLE_UNIT
        self.effect_square = self.effects @ self.effects.T

    def without_effects(
        self, effects: Floats, belief: Belief, shared: Floats | None = None
    ) -> tuple[Floats, Floats, Floats | None]:
        """Information and pull of cells and offsets alone, and what of `shared` falls to them.

        Parameters
        ----------
        effects : (p,) values at which free parameters stay from now on
        belief : hyperparameters; what is not known of the camera's ripple is taken off
        shared : (size, q) pull of what all throws err by together
        """
        told = slice(self.m + self.throws)
        acting = slice(told.stop, told.stop + len(effects))
        bent = np.concatenate([np.zeros(told.stop), effects, np.zeros(len(self.nodes))])
        pulls = (self.pull - self.information @ bent)[:, None]
        if shared is not None:
            pulls = np.column_stack([pulls, shared])
        information, left = self.information[told, told], pulls[told]
        if belief.ripple > 0.0 and len(self.nodes):
            root = belief.ripple * ripple_root(self.nodes, belief.ripple_length)
            across = self.information[told, acting.stop :] @ root
            own = root.T @ self.information[acting.stop :, acting.stop :] @ root
            goal = root.T @ pulls[acting.stop :]
            weights = np.linalg.solve(np.eye(len(own)) + own, np.column_stack([across.T, goal]))
            information = information - across @ weights[:, : told.stop]
            left = left - across @ weights[:, told.stop :]
        return information, left[:, 0], None if shared is None else left[:, 1:]

    def covariance(self, belief: Belief, first: int = 0) -> Floats:
        """Of the compressed data from the first one on, (r, r); they are sorted by information."""
        cells, level = self.rows[first:, : self.m], self.level[first:]
        field = matern(self.between, belief.length, belief.smoothness)
        field *= belief.spread**2 + np.outer(self.own, self.own)
        total = cells @ field @ cells.T
        total += LEVEL_SPREAD**2 * np.outer(level, level)
        total += belief.scatter**2 * self.offset_square[first:, first:]
        total += self.effect_square[first:, first:]
        if belief.ripple > 0.0 and len(self.nodes):
            ripple = self.ripple[first:] @ ripple_root(self.nodes, belief.ripple_length)
            total += belief.ripple**2 * (ripple @ ripple.T)
        total.flat[:: len(total) + 1] += 1.0
        return total

    def misfit(self, belief: Belief, first: int = 0) -> float:
        """−2·ln of evidence times hyperprior, but for `constant`."""
        chol = np.linalg.cholesky(self.covariance(belief, first))
        white = solve_triangular(chol, self.data[first:], lower=True)
        return (
            float(white @ white)
            + 2 * float(np.log(np.diag(chol)).sum())
            + (np.log(belief.spread / USUAL_SPREAD) / SPREAD_FREEDOM) ** 2
            + (np.log(belief.length / USUAL_LENGTH) / LENGTH_FREEDOM) ** 2
            + 2 * float(np.log1p((belief.scatter / USUAL_SCATTER) ** 2))
            + 2 * float(np.log1p((belief.ripple / USUAL_RIPPLE) ** 2))
            + (np.log(belief.ripple_length / USUAL_RIPPLE_LENGTH) / LENGTH_FREEDOM) ** 2
        )

    def best_belief(self, start: Belief, *, scatter: bool, coarse: bool = False) -> Belief:
        """Hyperparameters of the greatest evidence, of the smoothness of the start.

        A ripple is among them where the start has one.
        """
        sought = {
            "spread": (start.spread, 1e-3, 0.5),
            "length": (start.length, 0.4, 20.0),
        }
        if scatter:
            sought["scatter"] = (max(start.scatter, 1e-4), 1e-5, 0.1)
        if start.ripple > 0.0:
            sought["ripple"] = (start.ripple, 1e-5, 0.03)
            sought["ripple_length"] = (start.ripple_length, SHORTEST_RIPPLE, LONGEST_RIPPLE)
        first, low, high = np.log(list(sought.values())).T
        fixed = start if scatter else replace(start, scatter=0.0)

        def belief(p: Floats) -> Belief:
            values = np.exp(np.clip(p, low, high)).tolist()
            return replace(fixed, **dict(zip(sought, values, strict=True)))

        guess = first
        tolerance = 0.1 if coarse else 0.03
        found = minimize(
            lambda p: self.misfit(belief(p), self.clear if coarse else 0),
            guess,
            method="Nelder-Mead",
            options={
                "initial_simplex": np.vstack([guess, guess + 0.4 * np.eye(len(guess))]),
                "xatol": tolerance,
                "fatol": tolerance,
                "maxfev": 40 if coarse else 80 if start.ripple == 0.0 else 160,
            },
        )
        return belief(found.x)

    def first_belief(self, *, scatter: bool, ripple: float = 0.0) -> Belief:
        """Hyperparameters and smoothness of the greatest evidence, roughly.

        `ripple` is where its amplitude is first looked for; 0 for none.
        """
        start = Belief(
            spread=USUAL_SPREAD, length=USUAL_LENGTH, scatter=USUAL_SCATTER, ripple=ripple
        )
        middle = self.best_belief(start, scatter=scatter, coarse=True)
        if self.throws < FEW_THROWS:
            return middle
        tried = [middle]
        for smoothness, stretch in ((1.5, 1.4), (np.inf, 0.6)):
            like = replace(middle, smoothness=smoothness, length=middle.length * stretch)
            tried.append(self.best_belief(like, scatter=scatter, coarse=True))
        return min(tried, key=lambda belief: self.misfit(belief, self.clear))

    def posterior(self, belief: Belief, over: NDArray[np.bool_]) -> Posterior:
        """Estimate and standard errors of ln μ in every cell of the sheet.

        Parameters
        ----------
        belief : hyperparameters
        over : (cells,) those over which the level is the mean
        """
        cells, offsets = self.rows[:, : self.m], self.rows[:, self.m : self.m + self.throws]
        factor = cho_factor(self.covariance(belief), lower=True)
        weights = cho_solve(factor, self.data)
        field = matern(self.to_all, belief.length, belief.smoothness)
        field *= belief.spread**2 + np.outer(self.earlier, self.own)
        cross = field @ cells.T + LEVEL_SPREAD**2 * self.level
        shrink = (cross * cho_solve(factor, cross.T).T).sum(axis=1)
        variance = belief.spread**2 + self.earlier**2 + LEVEL_SPREAD**2 - shrink
        places = self.centres[over]
        apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
        alike = matern(apart, belief.length, belief.smoothness)
        alike *= belief.spread**2 + np.outer(self.earlier[over], self.earlier[over])
        mean = cross[over].mean(axis=0)
        level_variance = (
            float(alike.mean()) + LEVEL_SPREAD**2 - float(mean @ cho_solve(factor, mean))
        )
        inverse = cho_solve(factor, np.eye(len(self.data)))
        ripple = np.zeros((len(self.nodes), len(self.data)))
        ripple_variance = np.zeros(len(self.nodes))
        resolved = float(len(self.data) - np.trace(inverse))
        if belief.ripple > 0.0 and len(self.nodes):
            root = belief.ripple * ripple_root(self.nodes, belief.ripple_length)
            shown = self.ripple @ root
            ripple = root @ shown.T
            resolved -= float((shown * (inverse @ shown)).sum())  # these are not of the map
            ripple_variance = (root**2).sum(axis=1) - (ripple * (ripple @ inverse)).sum(axis=1)
        return Posterior(
            field=self.ground + cross @ weights,
            field_sigma=np.sqrt(np.maximum(variance, 0.0)),
            offsets=belief.scatter**2 * (offsets.T @ weights),
            level=float(mean @ weights + self.ground[over].mean()),
            level_sigma=float(np.sqrt(max(level_variance, 0.0))),
            resolved=resolved,
            belief=belief,
            effects=self.effects.T @ weights,
            effects_sigma=np.sqrt(
                np.maximum(1.0 - (self.effects * (inverse @ self.effects)).sum(axis=0), 0.0)
            ),
            ripple=ripple @ weights,
            ripple_sigma=np.sqrt(np.maximum(ripple_variance, 0.0)),
        )

    def blurred(self, posterior: Posterior, shared: Floats, over: NDArray[np.bool_]) -> Posterior:
        """The posterior with standard errors that know of what all throws err by together.

        Parameters
        ----------
        posterior : of these data
        shared : (size, q) how q independent errors of unit size pull
        over : (cells,) those over which the level is the mean
        """
        belief = posterior.belief
        cells = self.rows[:, : self.m]
        field = matern(self.to_all, belief.length, belief.smoothness)
        field *= belief.spread**2 + np.outer(self.earlier, self.own)
        cross = field @ cells.T + LEVEL_SPREAD**2 * self.level
        weights = np.linalg.solve(self.covariance(belief), self.compress @ shared)
        moved = cross @ weights
        acted = self.effects.T @ weights
        level = moved[over].mean(axis=0)
        return replace(
            posterior,
            field_sigma=np.hypot(posterior.field_sigma, np.linalg.norm(moved, axis=1)),
            level_sigma=float(np.hypot(posterior.level_sigma, np.linalg.norm(level))),
            effects_sigma=np.hypot(posterior.effects_sigma, np.linalg.norm(acted, axis=1)),
        )
