"""What may be missing: every effect of the catalogue, and what a camera may do to a path.

An effect that a user registers is a candidate at once: its card says which parameters switch it
on (those with a neutral value) and which only shape it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from curling_env.ice import ActiveEffect
from curling_env.physics.effects import EffectCard, Parameter, catalogue
from friction_estimation.discrepancy.session import Session

Floats = NDArray[np.float64]
Kind = Literal["physics", "measurement"]
Displacement = Callable[[Floats, Floats, Mapping[str, float]], Floats]
"""How a measured position differs from the true one: (xy, theta, parameters) -> (rows, 2)."""

UNDECIDABLE = ("scale_error", "frame_rate_error")
"""Errors that throws alone can never show: lengths, times and friction rescale together."""

LENS_RADIUS = 20.0
"""Distance from the image's centre at which `lens_distortion` quotes its strength [m]."""

PER_THROW = frozenset({"pebble_wear", "stone_bias", "time_drift"})
"""Effects that act on the friction of whole throws: they are seen between throws, not within."""


PUSHES_OF: Mapping[str, frozenset[str]] = {
    "curl": frozenset({"left"}),
    "slope": frozenset({"along the sheet", "across the sheet"}),
    "spin_drag": frozenset({"turn"}),
}
"""Directions in which an effect pushes; along the travel if it is not named here."""


def pushes_of(name: str) -> frozenset[str]:
    """Directions in which an effect pushes, as `unknown` calls them."""
    return PUSHES_OF.get(name, frozenset({"along"}))


@dataclass(frozen=True, kw_only=True)
class Form:
    """The form of a candidate.

    Parameters
    ----------
    name : in reports and ice files
    kind : of the ice, or of the measurement
    parameters : cards
    card : of an effect of the ice
    displacement : of an effect of the measurement
    sign : one line: what to look for in tracks
    """

    name: str
    kind: Kind
    parameters: tuple[Parameter, ...]
    sign: str = ""
    card: EffectCard | None = field(default=None, repr=False)
    displacement: Displacement | None = field(default=None, repr=False)

    def parameter(self, name: str) -> Parameter:
        return next(p for p in self.parameters if p.name == name)

    @property
    def switches(self) -> tuple[str, ...]:
        """Parameters that switch the effect off at their neutral value."""
        return tuple(p.name for p in self.parameters if p.neutral is not None)


@dataclass(frozen=True, kw_only=True)
class Term:
    """A candidate with values: a term of the model.

    Parameters
    ----------
    form : what it is
    values : of all its parameters
    free : names of those that are fitted
    """

    form: Form
    values: Mapping[str, float]
    free: tuple[str, ...]

    @property
    def name(self) -> str:
        return self.form.name

    @property
    def label(self) -> str:
        """Its name, with the stone where there is one for each."""
        return f"{self.name}[{self.values['stone']:.0f}]" if "stone" in self.values else self.name

    def with_values(self, **values: float) -> Term:
        return replace(self, values={**self.values, **values})

    def freed(self, *names: str) -> Term:
        """The same term with these parameters fitted as well."""
        return replace(self, free=(*self.free, *(n for n in names if n not in self.free)))

    def effect(self, sigma: Mapping[str, float] | None = None) -> ActiveEffect:
        """As it stands in an ice file."""
        return ActiveEffect(name=self.name, parameters=dict(self.values), sigma=dict(sigma or {}))


def _offset(xy: Floats, theta: Floats, values: Mapping[str, float]) -> Floats:
    cosine, sine = np.cos(theta), np.sin(theta)
    a, b = values["forward"], values["left"]
    return np.column_stack([a * cosine - b * sine, a * sine + b * cosine])


def _lens(xy: Floats, theta: Floats, values: Mapping[str, float]) -> Floats:
    from_centre = xy - np.array([values["centre_x"], values["centre_y"]])
    ratio = (from_centre**2).sum(axis=1, keepdims=True) / LENS_RADIUS**2
    return from_centre * (values["k1"] * ratio + values["k2"] * ratio**2)


def _number(name: str, unit: str, meaning: str, reach: float, **others: Any) -> Parameter:
    return Parameter(name=name, unit=unit, meaning=meaning, low=-reach, high=reach, **others)


TRACKING_OFFSET = Form(
    name="tracking_offset",
    kind="measurement",
    parameters=(
        _number("forward", "m", "ahead of the centre, along the heading", 0.2, neutral=0.0),
        _number("left", "m", "to the left of the heading", 0.2, neutral=0.0),
    ),
    sign="the path winds at the rate of the spin",
    displacement=_offset,
)

LENS_DISTORTION = Form(
    name="lens_distortion",
    kind="measurement",
    parameters=(
        _number("k1", "1", f"radial displacement over radius at {LENS_RADIUS:g} m", 0.3, neutral=0),
        _number("k2", "1", "the same, of fifth order", 0.3, default=0.0, neutral=0.0),
        _number("centre_x", "m", "where the optical axis meets the ice", 10.0, default=0.0),
        _number("centre_y", "m", "where the optical axis meets the ice", 25.0, default=0.0),
    ),
    sign="paths bend with the place in the image, with v², whatever the friction",
    displacement=_lens,
)

MEASUREMENTS = (TRACKING_OFFSET, LENS_DISTORTION)

SHAPES: Mapping[str, tuple[str, ...]] = {
    "curl": ("speed_exponent", "spin_exponent"),
    "spin_drag": ("speed_exponent", "spin_exponent"),
    "lens_distortion": ("centre_y", "k2"),
}
"""Parameters that shape an effect and that a session with varied throws can tell."""

OTHER_STARTS: Mapping[str, Mapping[str, float]] = {
    "spin_drag": {"rate": 0.01, "speed_exponent": 0.0, "spin_exponent": 1.0},
}
"""Values from which a candidate is fitted once more if it gains nothing from its usual shape: a
strength that must not be negative can be held at zero by a wrong shape."""


def form_of(card: EffectCard) -> Form:
    """A candidate's form from the card of an effect."""
    return Form(
        name=card.name,
        kind="physics",
        parameters=card.parameters,
        sign=card.evidence,
        card=card,
    )


def forms() -> dict[str, Form]:
    """All candidates by name."""
    cards = {name: form_of(card) for name, card in catalogue().items()}
    return cards | {form.name: form for form in MEASUREMENTS}


def _start(form: Form, **given: float) -> dict[str, float]:
    """Values at which the effect does nothing and its shape is the usual one."""
    values: dict[str, float] = {}
    for p in form.parameters:
        value = given.get(p.name, p.default if p.neutral is None else p.neutral)
        values[p.name] = float(value) if value is not None else 0.5 * (p.low + p.high)
    return values


def candidates(session: Session, terms: tuple[Term, ...] = ()) -> list[Term]:
    """Terms at their neutral values that these data could speak of, less those in the model.

    Parameters
    ----------
    terms : already in the model
    """
    taken = {term.label for term in terms}
    has_curl = any(term.name == "curl" for term in terms)
    found: list[Term] = []
    for form in forms().values():
        if not form.switches or form.name == "friction_patch":
            continue  # a patch is sought by its own means: it has edges
        if form.name == "stone_bias":
            stones, counts = np.unique(session.stones, return_counts=True)
            if len(stones) > 1:
                found += [
                    Term(form=form, values=_start(form, stone=float(s)), free=("factor",))
                    for s, n in zip(stones, counts, strict=True)
                    if n >= 2
                ]
            continue
        if not _speaks_of(session, form):
            continue
        free = tuple(n for n in form.switches if n not in SHAPES.get(form.name, ()))
        if form.name == "sweeping" and not has_curl:
            free = ("friction_factor",)
        found.append(Term(form=form, values=_start(form), free=free))
    return [term for term in found if term.label not in taken]


def _speaks_of(session: Session, form: Form) -> bool:
    """Whether the data hold what the effect acts through."""
    if form.name == "sweeping":
        return bool(session.swept.any())
    if form.name == "time_drift":
        return bool(np.ptp(session.clocks) > 60.0 and len(np.unique(session.clocks)) > 4)
    if form.name in ("curl", "spin_drag", "tracking_offset"):
        return bool(session.turns.any())
    return True


KNOWN = frozenset(
    {
        "speed_dependent_friction",
        "curl",
        "slope",
        "pebble_wear",
        "stone_bias",
        "sweeping",
        "friction_patch",
        "time_drift",
        "spin_drag",
        "air_drag",
    }
)
"""Effects of the project; any other in the catalogue was registered by a user."""


def finer_starts(term: Term) -> list[dict[str, float]]:
    """Where the finer forms of a fitted term are begun; none for most.

    Their parameters are freed only where the simpler form leaves something. They begin with the
    slope that the simpler form has at 1 m/s: from further off a fit would lose its way.
    """
    if term.name == "friction_patch":
        return [{"edge": 0.5}, {"edge": 1.5}]
    if term.name != "speed_dependent_friction":
        return []
    n = term.values["exponent"]
    starts = [{"exponent": -1.0, "share": float(np.clip(-n, -0.19, 0.5)), "speed_offset": 0.0}]
    if n > 0.0:
        starts += [
            {"exponent": 1.0, "share": min(0.9, n * (1.0 + offset) ** 2), "speed_offset": offset}
            for offset in (0.06, 0.9)
        ]
    return starts
