"""Prior and posterior of the friction map: ln μ is a smooth Gaussian field over the sheet.

ln μ is a constant of which nothing is known, plus a Matérn field whose spread and length the data
choose by their evidence (marginal likelihood), plus, where throws scatter, an offset of each throw
whose spread is chosen in the same way. Where the camera has a smooth bias along the sheet, that is
one more field, in metres, with an amplitude and a length of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh, solve_triangular
from scipy.optimize import minimize

from curling_env.sheet import Sheet
from curling_env.typing import Flags, Floats, Indices
from friction_estimation.inversion.matern import matern
from friction_estimation.inversion.throw.camera_bias import bias_root
from friction_estimation.inversion.tuning import (
    CAMERA_BIAS_UNIT,
    CLEAR_INFORMATION,
    EFFECT_PRIOR_SD,
    LEVEL_PRIOR_SD,
    LOG_LENGTH_SD,
    LOG_SPREAD_SD,
    MIN_INFORMATION,
    MIN_THROWS_FOR_SMOOTHNESS,
    USUAL_CAMERA_BIAS,
    USUAL_CAMERA_BIAS_LENGTH,
    USUAL_LENGTH,
    USUAL_SCATTER,
    USUAL_SPREAD,
)


@dataclass(frozen=True, kw_only=True)
class Hyperparameters:
    """Hyperparameters of the prior.

    Parameters
    ----------
    spread : standard deviation of ln μ over the sheet
    length : correlation length of ln μ [m]
    scatter : standard deviation of ln μ from throw to throw
    smoothness : Matérn order of the field: 1.5, 2.5 or infinity
    bias_sd, bias_length : standard deviation and correlation length of the camera's bias along the
        sheet [m]; a standard deviation of 0 means no bias
    """

    spread: float
    length: float
    scatter: float
    smoothness: float = 2.5
    bias_sd: float = 0.0
    bias_length: float = USUAL_CAMERA_BIAS_LENGTH


@dataclass(frozen=True, kw_only=True)
class Posterior:
    """Estimate of ln μ relative to the reference.

    Parameters
    ----------
    field, field_sigma : (cells,) mean and standard error
    offsets : (throws,) offset of each throw
    level, level_sigma : mean of the field over the cells asked for, and its standard error
    resolved : number of independent numbers that the data determine
    hyperparameters : hyperparameters of the prior
    effects, effects_sigma : (p,) free parameters of effects and their standard errors, in prior
        standard deviations
    bias, bias_sigma : (n,) displacement by the camera at its nodes, and its standard error [m]
    """

    field: Floats
    field_sigma: Floats
    offsets: Floats
    level: float
    level_sigma: float
    resolved: float
    hyperparameters: Hyperparameters
    effects: Floats
    effects_sigma: Floats
    bias: Floats
    bias_sigma: Floats


class NormalEquations:
    """Normal equations of all throws in ln μ, with the release states projected out.

    The unknowns are ln μ of the m cells that were crossed, the offset of each throw, p free
    parameters of effects in prior standard deviations, and the camera's bias at n nodes [m].

    Parameters
    ----------
    matrix : (size, size) products of the sensitivities
    vector : (size,) products of sensitivities and residuals, with the present estimate added back
    crossed : (m,) flat indices of the cells
    sheet : sheet of the cells
    prior_mean : (cells,) mean about which the field varies; zero where None
    prior_sd : (cells,) relative standard error that an earlier ice gives each cell; what has
        changed since then is added to it. Zero where None
    effects : p
    nodes : (n,) nodes of the bias along the sheet [m]; none where None
    square : sum of squares of the whitened rows, with the present estimate added back, plus 2·ln of
        the volume of their noise; it makes evidences under different noise comparable
    """

    def __init__(
        self,
        matrix: Floats,
        vector: Floats,
        crossed: Indices,
        sheet: Sheet,
        *,
        prior_mean: Floats | None = None,
        prior_sd: Floats | None = None,
        effects: int = 0,
        nodes: Floats | None = None,
        square: float = 0.0,
    ) -> None:
        zero = np.zeros(sheet.shape[0] * sheet.shape[1])
        self.matrix, self.vector, self.cells = matrix, vector, crossed
        self.prior_mean = zero if prior_mean is None else prior_mean
        self.prior_sd = zero if prior_sd is None else prior_sd
        self.m = len(crossed)
        self.nodes = np.empty(0) if nodes is None else nodes
        self.throws = len(vector) - self.m - effects - len(self.nodes)
        columns = sheet.shape[1]
        x = sheet.x_centres[np.arange(sheet.shape[0] * columns) % columns]
        y = sheet.y_centres[np.arange(sheet.shape[0] * columns) // columns]
        self._centres = np.column_stack([x, y])
        own = self._centres[crossed]
        self._between = np.hypot(*(own[:, None] - own[None]).transpose(2, 0, 1))
        self._to_all = np.hypot(*(self._centres[:, None] - own[None]).transpose(2, 0, 1))
        # Compression: the eigenvectors with enough information become data of unit noise. They are
        # chosen in units in which every unknown is as little known as the friction of a cell.
        acting = slice(self.m + self.throws, self.m + self.throws + effects)
        unit = np.ones(len(vector))
        unit[acting] = 1.0 / EFFECT_PRIOR_SD
        unit[acting.stop :] = CAMERA_BIAS_UNIT
        values, vectors = eigh(matrix * np.outer(unit, unit))
        informed = values > MIN_INFORMATION
        root = np.sqrt(values[informed])
        self.clear = int((values[informed] <= CLEAR_INFORMATION).sum())
        beyond = unit * (vector - matrix[:, : self.m] @ self.prior_mean[crossed])
        self.data = (vectors[:, informed].T @ beyond) / root
        self._compress = vectors[:, informed].T * unit / root[:, None]
        mean = self.prior_mean[crossed]
        square -= float(mean @ (2 * vector[: self.m] - matrix[: self.m, : self.m] @ mean))
        self.constant = square - float(self.data @ self.data)
        self._rows = root[:, None] * vectors[:, informed].T
        self._level = self._rows[:, : self.m].sum(axis=1)
        offsets = self._rows[:, self.m : self.m + self.throws]
        self._offset_square = offsets @ offsets.T
        self._effects = EFFECT_PRIOR_SD * self._rows[:, acting]
        self._effect_square = self._effects @ self._effects.T
        self.bias_rows = self._rows[:, acting.stop :] / CAMERA_BIAS_UNIT

    def without_effects(
        self, effects: Floats, hyper: Hyperparameters, systematic: Floats | None = None
    ) -> tuple[Floats, Floats, Floats | None]:
        """Matrix and vector of cells and offsets alone, and the part of `systematic` in them.

        Parameters
        ----------
        effects : (p,) values at which the free parameters stay from now on
        hyper : hyperparameters; the uncertainty of the camera's bias is integrated out
        systematic : (size, q) change of the vector by errors that all throws share
        """
        friction = slice(self.m + self.throws)
        acting = slice(friction.stop, friction.stop + len(effects))
        fixed = np.concatenate([np.zeros(friction.stop), effects, np.zeros(len(self.nodes))])
        vectors = (self.vector - self.matrix @ fixed)[:, None]
        if systematic is not None:
            vectors = np.column_stack([vectors, systematic])
        matrix, reduced = self.matrix[friction, friction], vectors[friction]
        if hyper.bias_sd > 0.0 and len(self.nodes):
            root = hyper.bias_sd * bias_root(self.nodes, hyper.bias_length)
            across = self.matrix[friction, acting.stop :] @ root
            own = root.T @ self.matrix[acting.stop :, acting.stop :] @ root
            goal = root.T @ vectors[acting.stop :]
            weights = np.linalg.solve(np.eye(len(own)) + own, np.column_stack([across.T, goal]))
            matrix = matrix - across @ weights[:, : friction.stop]
            reduced = reduced - across @ weights[:, friction.stop :]
        return matrix, reduced[:, 0], None if systematic is None else reduced[:, 1:]

    def covariance(self, hyper: Hyperparameters, first: int = 0) -> Floats:
        """Covariance of the compressed data from the `first` on, (r, r).

        The data are sorted by increasing information.
        """
        cells, level = self._rows[first:, : self.m], self._level[first:]
        field = matern(self._between, hyper.length, hyper.smoothness)
        own = self.prior_sd[self.cells]
        field *= hyper.spread**2 + np.outer(own, own)
        total = cells @ field @ cells.T
        total += LEVEL_PRIOR_SD**2 * np.outer(level, level)
        total += hyper.scatter**2 * self._offset_square[first:, first:]
        total += self._effect_square[first:, first:]
        if hyper.bias_sd > 0.0 and len(self.nodes):
            bias = self.bias_rows[first:] @ bias_root(self.nodes, hyper.bias_length)
            total += hyper.bias_sd**2 * (bias @ bias.T)
        total.flat[:: len(total) + 1] += 1.0
        return total

    def minus_two_log_evidence(self, hyper: Hyperparameters, first: int = 0) -> float:
        """−2·ln of evidence times hyperprior, without `constant`."""
        chol = np.linalg.cholesky(self.covariance(hyper, first))
        white = solve_triangular(chol, self.data[first:], lower=True)
        return (
            float(white @ white)
            + 2 * float(np.log(np.diag(chol)).sum())
            + (np.log(hyper.spread / USUAL_SPREAD) / LOG_SPREAD_SD) ** 2
            + (np.log(hyper.length / USUAL_LENGTH) / LOG_LENGTH_SD) ** 2
            + 2 * float(np.log1p((hyper.scatter / USUAL_SCATTER) ** 2))
            + 2 * float(np.log1p((hyper.bias_sd / USUAL_CAMERA_BIAS) ** 2))
            + (np.log(hyper.bias_length / USUAL_CAMERA_BIAS_LENGTH) / LOG_LENGTH_SD) ** 2
        )

    def optimise_hyperparameters(
        self, start: Hyperparameters, *, scatter: bool, coarse: bool = False
    ) -> Hyperparameters:
        """Hyperparameters of the greatest evidence, of the same smoothness as the start.

        Parameters
        ----------
        start : first guess; the bias of the camera is fitted where the start has one
        scatter : whether throws may scatter
        coarse : whether a rough answer from the clearest data is enough
        """
        wanted = {
            "spread": (start.spread, 1e-3, 0.5),
            "length": (start.length, 0.4, 20.0),
        }
        if scatter:
            wanted["scatter"] = (max(start.scatter, 1e-4), 1e-5, 0.1)
        if start.bias_sd > 0.0:
            wanted["bias_sd"] = (start.bias_sd, 1e-5, 0.03)
            # The length is about a fifth of its waves. Longer waves belong to the camera's pose and
            # lens, and resemble a slope or a friction that depends on speed.
            wanted["bias_length"] = (start.bias_length, 0.7, 3.0)
        first, low, high = np.log(list(wanted.values())).T
        fixed = start if scatter else replace(start, scatter=0.0)

        def hyperparameters(p: Floats) -> Hyperparameters:
            values = np.exp(np.clip(p, low, high)).tolist()
            return replace(fixed, **dict(zip(wanted, values, strict=True)))

        tolerance = 0.1 if coarse else 0.03
        found = minimize(
            lambda p: self.minus_two_log_evidence(hyperparameters(p), self.clear if coarse else 0),
            first,
            method="Nelder-Mead",
            options={
                "initial_simplex": np.vstack([first, first + 0.4 * np.eye(len(first))]),
                "xatol": tolerance,
                "fatol": tolerance,
                "maxfev": 40 if coarse else 80 if start.bias_sd == 0.0 else 160,
            },
        )
        return hyperparameters(found.x)

    def initial_hyperparameters(self, *, scatter: bool, bias_sd: float = 0.0) -> Hyperparameters:
        """Hyperparameters and smoothness of the greatest evidence, roughly.

        Parameters
        ----------
        scatter : whether throws may scatter
        bias_sd : first guess of the amplitude of the camera's bias [m]; 0 for none
        """
        start = Hyperparameters(
            spread=USUAL_SPREAD, length=USUAL_LENGTH, scatter=USUAL_SCATTER, bias_sd=bias_sd
        )
        middle = self.optimise_hyperparameters(start, scatter=scatter, coarse=True)
        if self.throws < MIN_THROWS_FOR_SMOOTHNESS:
            return middle
        tried = [middle]
        for smoothness, stretch in ((1.5, 1.4), (np.inf, 0.6)):
            like = replace(middle, smoothness=smoothness, length=middle.length * stretch)
            tried.append(self.optimise_hyperparameters(like, scatter=scatter, coarse=True))
        return min(tried, key=lambda hyper: self.minus_two_log_evidence(hyper, self.clear))

    def posterior(self, hyper: Hyperparameters, over: Flags) -> Posterior:
        """Estimate and standard errors of ln μ in every cell of the sheet.

        Parameters
        ----------
        hyper : hyperparameters
        over : (cells,) cells over which the level is the mean
        """
        offsets = self._rows[:, self.m : self.m + self.throws]
        factor = cho_factor(self.covariance(hyper), lower=True)
        weights = cho_solve(factor, self.data)
        cross = self._cross_covariance(hyper)
        shrink = (cross * cho_solve(factor, cross.T).T).sum(axis=1)
        variance = hyper.spread**2 + self.prior_sd**2 + LEVEL_PRIOR_SD**2 - shrink
        places = self._centres[over]
        apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
        alike = matern(apart, hyper.length, hyper.smoothness)
        alike *= hyper.spread**2 + np.outer(self.prior_sd[over], self.prior_sd[over])
        mean = cross[over].mean(axis=0)
        level_variance = (
            float(alike.mean()) + LEVEL_PRIOR_SD**2 - float(mean @ cho_solve(factor, mean))
        )
        inverse = cho_solve(factor, np.eye(len(self.data)))
        bias = np.zeros((len(self.nodes), len(self.data)))
        bias_variance = np.zeros(len(self.nodes))
        resolved = float(len(self.data) - np.trace(inverse))
        if hyper.bias_sd > 0.0 and len(self.nodes):
            root = hyper.bias_sd * bias_root(self.nodes, hyper.bias_length)
            shown = self.bias_rows @ root
            bias = root @ shown.T
            # What the data determine in the bias is not counted as detail of the map.
            resolved -= float((shown * (inverse @ shown)).sum())
            bias_variance = (root**2).sum(axis=1) - (bias * (bias @ inverse)).sum(axis=1)
        return Posterior(
            field=self.prior_mean + cross @ weights,
            field_sigma=np.sqrt(np.maximum(variance, 0.0)),
            offsets=hyper.scatter**2 * (offsets.T @ weights),
            level=float(mean @ weights + self.prior_mean[over].mean()),
            level_sigma=float(np.sqrt(max(level_variance, 0.0))),
            resolved=resolved,
            hyperparameters=hyper,
            effects=self._effects.T @ weights,
            effects_sigma=np.sqrt(
                np.maximum(1.0 - (self._effects * (inverse @ self._effects)).sum(axis=0), 0.0)
            ),
            bias=bias @ weights,
            bias_sigma=np.sqrt(np.maximum(bias_variance, 0.0)),
        )

    def with_systematic_error(
        self, posterior: Posterior, systematic: Floats, over: Flags
    ) -> Posterior:
        """The posterior with standard errors that include what all throws err by together.

        Parameters
        ----------
        posterior : posterior of these data
        systematic : (size, q) change of the vector by q independent errors of unit size
        over : (cells,) cells over which the level is the mean
        """
        hyper = posterior.hyperparameters
        cross = self._cross_covariance(hyper)
        weights = np.linalg.solve(self.covariance(hyper), self._compress @ systematic)
        moved = cross @ weights
        acted = self._effects.T @ weights
        level = moved[over].mean(axis=0)
        return replace(
            posterior,
            field_sigma=np.hypot(posterior.field_sigma, np.linalg.norm(moved, axis=1)),
            level_sigma=float(np.hypot(posterior.level_sigma, np.linalg.norm(level))),
            effects_sigma=np.hypot(posterior.effects_sigma, np.linalg.norm(acted, axis=1)),
        )

    def _cross_covariance(self, hyper: Hyperparameters) -> Floats:
        """Prior covariance between all cells and the compressed data, (cells, r)."""
        field = matern(self._to_all, hyper.length, hyper.smoothness)
        field *= hyper.spread**2 + np.outer(self.prior_sd, self.prior_sd[self.cells])
        return field @ self._rows[:, : self.m].T + LEVEL_PRIOR_SD**2 * self._level
