"""What may be missing: every effect of the catalogue, and what a camera may do to a path.

An effect that a user registers is a candidate at once: its card says which parameters switch it
on (those with a neutral value) and which only shape it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.ice import ActiveEffect
from curling_env.physics.effects import catalogue
from friction_estimation.discovery.data.form import Form, form_of
from friction_estimation.discovery.data.measurement import MEASUREMENTS
from friction_estimation.discovery.data.session import Session

UNDECIDABLE = ("scale_error", "frame_rate_error")
"""Errors that throws alone can never show: lengths, times and friction rescale together."""

PER_THROW = frozenset({"pebble_wear", "stone_bias", "time_drift"})
"""Effects that act on the friction of whole throws: they are seen between throws, not within."""

ALONG_PATH = "along_path"
"""Parameter of `pebble_wear` in its finer form: worn where stones ran, and not all over."""


def without_stone(label: str) -> str:
    """A label without the stone it is of; other forms of an effect keep theirs."""
    name, _, which = label.partition("[")
    return label if which == f"{ALONG_PATH}]" else name


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
        """Its name, with the stone where there is one for each, or with the form it has."""
        if "stone" in self.values:
            return f"{self.name}[{self.values['stone']:.0f}]"
        return f"{self.name}[{ALONG_PATH}]" if self.free == (ALONG_PATH,) else self.name

    @property
    def between_throws(self) -> bool:
        """Whether it acts on the friction of whole throws, so that it is not seen within one."""
        return self.name in PER_THROW and self.free != (ALONG_PATH,)

    def with_values(self, **values: float) -> Term:
        return replace(self, values={**self.values, **values})

    def freed(self, *names: str) -> Term:
        """The same term with these parameters fitted as well."""
        return replace(self, free=(*self.free, *(n for n in names if n not in self.free)))

    def effect(self, sigma: Mapping[str, float] | None = None) -> ActiveEffect:
        """As it stands in an ice file."""
        return ActiveEffect(name=self.name, parameters=dict(self.values), sigma=dict(sigma or {}))


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


def forms(measurements: Sequence[Form] = MEASUREMENTS) -> dict[str, Form]:
    """All candidates by name.

    Parameters
    ----------
    measurements : what the camera may do
    """
    cards = {name: form_of(card) for name, card in catalogue().items()}
    return cards | {form.name: form for form in measurements}


FORMS = frozenset({"pebble_wear"})
"""Effects of which each form is a candidate by itself."""


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
    for form in forms(session.measurements).values():
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
        if form.name == "pebble_wear" and _run_over(session):
            found.append(Term(form=form, values=_start(form), free=(ALONG_PATH,)))
        finer = (*SHAPES.get(form.name, ()), "lens_p1", "lens_p2")
        free = tuple(n for n in form.switches if n not in finer)
        if form.name == "sweeping" and not has_curl:
            free = ("friction_factor",)
        found.append(Term(form=form, values=_start(form), free=free))
    fitted = {(term.name, name) for term in terms for name in term.free if term.name in FORMS}
    return [
        term
        for term in found
        if term.label not in taken and not fitted & {(term.name, name) for name in term.free}
    ]


def _run_over(session: Session) -> bool:
    """Whether throws ran on ice that earlier ones had run on."""
    return bool(len(session.lanes.orders) and session.orders.max() > session.lanes.orders.min())


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
    if term.name == "lens_distortion":
        finer = ("lens_p1", "lens_p2") if "lens_p1" in term.values else ("centre_x",)
        return [dict.fromkeys(finer, 0.0)]
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
