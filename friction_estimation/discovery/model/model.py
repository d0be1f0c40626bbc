"""The model of a session: an ice, its terms with their parameters, and its predictions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from curling_env.ice import MAX_FRICTION, FrictionMap, Ice
from curling_env.ice_form import Interpolation, LevelError
from curling_env.physics.law import Law, compile_law, on_tracks
from curling_env.physics.state import State
from curling_env.physics.wear import wear_along_path, wear_under_contacts
from curling_env.sheet import Sheet
from curling_env.typing import Floats, Indices
from friction_estimation.discovery.data.session import Session, no_pushes
from friction_estimation.discovery.data.wear_tracks import wear_refinement
from friction_estimation.discovery.model.candidates import Belief, Term
from friction_estimation.discovery.model.forward import (
    ThrowInputs,
    Wear,
    slide_session,
)
from friction_estimation.discovery.model.friction_field import FrictionField
from friction_estimation.discovery.model.gaussian_field import (
    CameraField,
    CameraRipple,
    GaussianField,
)

GLOBALS = ("ln_mu", "ln_coupling")
"""Shared parameters of every model: logarithms of a factor on the friction of the whole map, and of
one on m·r²/I, the ratio of torque to friction, which is known to ten per cent at best."""
NO_WEAR = Wear(np.zeros((1, 1, 1)), 0.0)
"""Wear of zero along the paths of earlier stones."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Model:
    """A base ice and the terms added to it.

    Parameters
    ----------
    ice : map, sheet and stone; its own effects are among the terms
    terms : effects of the ice and of the measurement
    ln_mu, ln_coupling : the shared parameters `GLOBALS`
    spread : standard deviation of ln μ from throw to throw
    systematic_error : displacement of places that all throws share; None for tracks without
    ripple : the same along the sheet, in shorter waves; None for a camera without
    own_cells_wear : whether wear along paths is kept in the map's own cells, however wide, and not
        in cells as narrow as a worn track
    steps : steps of finite differences that were found, by (term, parameter)
    """

    ice: Ice
    terms: tuple[Term, ...] = ()
    ln_mu: float = 0.0
    ln_coupling: float = 0.0
    spread: float = 0.0
    systematic_error: CameraField | None = None
    ripple: CameraRipple | None = None
    own_cells_wear: bool = False
    steps: dict[tuple[str, str], float] = field(default_factory=dict, repr=False)

    @property
    def map_field(self) -> FrictionField | None:
        """The friction map, if it is one of the terms."""
        return next((term.map_field for term in self.terms if term.map_field), None)

    @cached_property
    def _places(self) -> list[tuple[slice, GaussianField | None]]:
        """Slices of the shared parameters of each possible field."""
        fields = (self.systematic_error, self.ripple, self.map_field)
        ends = np.cumsum([len(GLOBALS), *(0 if f is None else len(f) for f in fields)]).tolist()
        return [(slice(*ends[k : k + 2]), field) for k, field in enumerate(fields)]

    @property
    def ripple_slice(self) -> slice:
        """Slice of the coefficients of the camera's ripple among the shared parameters."""
        return self._places[1][0]

    @property
    def map_slice(self) -> slice:
        """Slice of the coefficients of the friction map among the shared parameters."""
        return self._places[2][0]

    @cached_property
    def fields(self) -> tuple[tuple[slice, GaussianField], ...]:
        """Fitted Gaussian fields, with the slices of their coefficients."""
        return tuple((place, field) for place, field in self._places if field)

    def with_amplitude(self, which: int, amplitude: float) -> Model:
        """Return the model with another amplitude of one of its `fields`."""
        field = self.fields[which][1].with_amplitude(amplitude)
        return self._with_fields({field.name: field})

    def _with_fields(self, fields: Mapping[str, GaussianField]) -> Model:
        """Return the model with other fields, by name."""
        terms = tuple(
            replace(t, map_field=fields.get("map", t.map_field)) if t.map_field else t
            for t in self.terms
        )
        return replace(
            self,
            terms=terms,
            systematic_error=fields.get("systematic_error", self.systematic_error),
            ripple=fields.get("ripple", self.ripple),
        )

    @property
    def names(self) -> list[tuple[str, str]]:
        """(term, parameter) of every shared parameter; the term is empty if it has none."""
        return (
            [("", name) for name in GLOBALS]
            + [("", f"{field.name}_{k}") for _, field in self.fields for k in range(len(field))]
            + [(term.label, name) for term in self.terms for name in term.free]
        )

    @property
    def vector(self) -> Floats:
        """Values of the shared parameters in the order of `names`."""
        fields = [field.values for _, field in self.fields]
        values = np.concatenate([[self.ln_mu, self.ln_coupling], *fields]).tolist()
        return np.array(values + [term.values[n] for term in self.terms for n in term.free])

    @cached_property
    def beliefs(self) -> list[tuple[int, float, Belief]]:
        """Index, value and prior of every shared parameter that has a prior."""
        places = {name: k for k, name in enumerate(self.names)}
        return [
            (places[term.label, name], term.values[name], belief)
            for term in self.terms
            for name, belief in term.beliefs.items()
            if name in term.free
        ]

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Least and largest values of the shared parameters."""
        cards = [term.card.parameter(n) for term in self.terms for n in term.free]
        wide = [np.inf] * (self.map_slice.stop - len(GLOBALS))
        low = [-3.0, -1.0, *(-w for w in wide), *(p.low for p in cards)]
        high = [3.0, 1.0, *wide, *(p.high for p in cards)]
        return np.array(low), np.array(high)

    def at(self, vector: Floats) -> Model:
        """Return the model with other shared parameters, kept within their bounds."""
        vector = np.clip(vector, *self.bounds)
        position = self.map_slice.stop
        terms: list[Term] = []
        for term in self.terms:
            changed = dict(zip(term.free, vector[position:].tolist(), strict=False))
            position += len(term.free)
            terms.append(term.with_values(**changed) if changed else term)
        moved = replace(
            self, terms=tuple(terms), ln_mu=float(vector[0]), ln_coupling=float(vector[1])
        )
        return moved._with_fields({f.name: f.at(vector[place]) for place, f in self.fields})

    def with_terms(self, *terms: Term) -> Model:
        """Return the model with more terms."""
        return replace(self, terms=(*self.terms, *terms))

    def without(self, *labels: str) -> Model:
        """Return the model without some of its terms."""
        return replace(self, terms=tuple(t for t in self.terms if t.label not in labels))

    def term(self, label: str) -> Term:
        """Return the term of that label."""
        return next(t for t in self.terms if t.label == label)

    @cached_property
    def _ice_with_terms(self) -> Ice:
        """The ice with the terms as its effects."""
        effects = tuple(term.effect() for term in self.terms if not term.map_field)
        return replace(self.ice, effects=effects)

    @cached_property
    def law(self) -> Law:
        """The force law of the ice with the terms."""
        law = compile_law(self._ice_with_terms)
        mu, patterned = law.mu, law.patterned
        if self.map_field:
            mu, patterned = mu * np.exp(self.map_field.ln_mu), True
        elif self.ice.friction.is_uniform:
            mu = mu[:1, :1]
        return law._replace(
            mu=np.ascontiguousarray(mu) * np.exp(self.ln_mu),
            patterned=patterned,
            turning=law.turning * float(np.exp(self.ln_coupling)),
        )

    def law_in(self, session: Session) -> Law:
        """Return the force law with the worn tracks of a session's stones.

        If they wear the map itself, it has cells for that.
        """
        law = self.law if wear_along_path(self._ice_with_terms) == 0.0 else self._law_on_wear_cells
        wear = wear_under_contacts(self._ice_with_terms)
        if wear == 0.0:
            return law
        return on_tracks(law, *session.wear_tracks.tracks(self.ice.sheet), wear)

    @cached_property
    def _law_on_wear_cells(self) -> Law:
        """The force law, with its map on the cells for wear along paths."""
        # A fit may pass through impossible friction; only its result is checked.
        mu = np.broadcast_to(np.minimum(self.law.mu, MAX_FRICTION), self.ice.sheet.shape)
        like = self.ice.friction.interpolation
        finer = _on_finer_cells(mu.tobytes(), self.ice.sheet, like, self.wear_refinement)
        return self.law._replace(
            mu=finer.mu, origin_x=finer.origin_x, origin_y=finer.origin_y, cell=finer.cell
        )

    @property
    def wear_refinement(self) -> int:
        """Number of parts of a cell's side for wear along paths."""
        return 1 if self.own_cells_wear else wear_refinement(self.ice.sheet)

    @property
    def wear_sheet(self) -> Sheet:
        """The sheet, with the cells for wear along paths."""
        sheet = self.ice.sheet
        return replace(sheet, cell_size=sheet.cell_size / self.wear_refinement)

    def wear(self, session: Session) -> Wear:
        """Return the wear by the stones of a session along their paths."""
        along_path = wear_along_path(self._ice_with_terms)
        if along_path == 0.0:
            return NO_WEAR
        return Wear(session.wear_tracks.passes(self.wear_sheet), along_path)

    def improved_ice(
        self,
        sigma: Mapping[tuple[str, str], float],
        map_sigma: Floats | None = None,
        *,
        level: LevelError | None = None,
        common: Mapping[tuple[str, str], tuple[float, ...]] | None = None,
    ) -> Ice:
        """Return the ice for an ice file.

        If stones wear tracks into it, its cells are narrow enough for them.

        Parameters
        ----------
        sigma : standard errors by (term, parameter)
        map_sigma : (rows, columns) standard errors of ln μ of the cells, where there is a map
        level : the error that all cells have in common
        common : what errors of parameters have in common with others, by (term, parameter)
        """
        common = common or {}
        factor = float(np.exp(self.ln_mu))
        with_terms = self._ice_with_terms
        worn = wear_along_path(with_terms) != 0.0 or wear_under_contacts(with_terms) != 0.0
        ice = self.ice if map_sigma is None else self._mapped_ice(map_sigma)
        ice = ice.refined(self.wear_refinement) if worn else ice
        friction = ice.friction
        own = friction.sigma
        if map_sigma is None:
            own = np.hypot(own, friction.mu * sigma.get(("", "ln_mu"), 0.0))
        stone = self.ice.stone
        inertia = stone.inertia / float(np.exp(self.ln_coupling))
        return replace(
            ice,
            friction=replace(friction, mu=friction.mu * factor, sigma=own * factor, level=level),
            stone=replace(stone, inertia=inertia),
            effects=tuple(
                term.effect(
                    {n: sigma[term.label, n] for n in term.free if (term.label, n) in sigma},
                    {n: common[term.label, n] for n in term.free if (term.label, n) in common},
                )
                for term in self.terms
                if not term.map_field
            ),
        )

    def _mapped_ice(self, map_sigma: Floats) -> Ice:
        """Return the ice with its friction map, without the overall factor."""
        assert self.map_field is not None
        friction = self.ice.friction
        mu = friction.mu * np.exp(self.map_field.ln_mu)
        observed = np.zeros(mu.size, dtype=bool)
        observed[self.map_field.crossed] = True
        return replace(
            self.ice,
            friction=replace(
                friction, mu=mu, sigma=mu * map_sigma, observed=observed.reshape(mu.shape)
            ),
        )


@lru_cache(maxsize=4)
def _on_finer_cells(mu: bytes, sheet: Sheet, interpolation: Interpolation, times: int) -> Law:
    """Return the law of ice without effects on narrower cells.

    Cached because derivatives by parameters of effects leave the map as it is.

    Parameters
    ----------
    mu : (rows, columns) friction of the cells of the sheet
    sheet, interpolation : as of `Ice` and `FrictionMap`
    times : as of `Ice.refined`
    """
    cells = np.frombuffer(mu).reshape(sheet.shape)
    unknown = np.zeros(sheet.shape)
    friction = FrictionMap(
        mu=cells, sigma=unknown, observed=unknown > 0.0, interpolation=interpolation
    )
    return compile_law(Ice(friction=friction, sheet=sheet).refined(times))


def predict(
    model: Model, session: Session, states: Floats, ln_factors: Floats, *, camera: bool = True
) -> Floats:
    """States of every row as the model predicts them.

    Parameters
    ----------
    model : model of the ice and the camera
    session : throws, of which only the circumstances are used
    states : (k, 6) release states x, y, vx, vy, theta, omega
    ln_factors : (k,) deviation of ln μ of each throw
    camera : whether x and y are those that the camera reports, or the true ones

    Returns
    -------
    (rows, 6)
    """
    out = true_states(model, session, states, ln_factors, session.times, session.starts)
    return reported(model, out) if camera else out


def true_states(
    model: Model,
    session: Session,
    states: Floats,
    ln_factors: Floats,
    times: Floats,
    starts: Indices,
) -> Floats:
    """True states at some times of every throw, (n, 6); `times` and `starts` as of `Session`."""
    out = np.empty((len(times), 6))
    slide_session(
        model.law_in(session),
        model.wear(session),
        np.exp(ln_factors),
        states,
        throw_inputs(session, times, starts),
        out,
    )
    return out


def throw_inputs(session: Session, times: Floats, starts: Indices) -> ThrowInputs:
    """Return the inputs of the throws of a session, for some times."""
    switches, firsts, swept_first = session.sweeps
    return ThrowInputs(
        orders=session.orders,
        stones=session.stones,
        clocks=session.clocks,
        ran=session.wear_tracks.before(session.orders),
        swept_first=swept_first,
        switches=switches,
        switch_starts=firsts,
        times=times,
        starts=starts,
        pushes=no_pushes(len(session)) if session.pushes is None else session.pushes,
    )


def reported(model: Model, true: Floats) -> Floats:
    """True states (n, 6) as the camera reports them."""
    out, xy = true.copy(), true[:, :2]
    for term in model.terms:
        if term.card.displacement is not None:
            out[:, :2] += term.card.displacement(xy, true[:, State.THETA], term.values)
    for shift in (model.systematic_error, model.ripple):
        if shift is not None:
            out[:, :2] += shift.displacement(xy, true[:, State.THETA])
    return out
