"""Card of an effect: all its properties except the compiled kernel.

Ice files, engines, discovery, figures and observations read the card, so that an effect is complete
in one file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from typing import Any, Literal

from curling_env.errors import InputError
from curling_env.typing import Floats

Acts = Literal["friction", "contact_friction", "motion", "map", "measurement", "nothing"]
Scope = Literal["within throws", "between throws"]
Push = Literal["along", "left", "turn", "along the sheet", "across the sheet"]
Need = Literal["swept", "clocks", "headings", "several stones", "runs over the same ice"]
Variable = Literal[
    "speed", "x", "y", "t", "theta", "spin", "order", "clock", "stone", "swept", "passes"
]
Values = Mapping[str, float]

Breaks = Callable[[Values], tuple[float, ...]]
Displacement = Callable[[Floats, Floats, Values], Floats]
"""Reported minus true position (n, 2) [m], from true positions (n, 2), headings (n,),
parameters.
"""
Starts = Callable[[Values], Sequence[Values]]
Turned = Callable[[Values], Values]


def _none(_: Values) -> tuple[()]:
    return ()


@dataclass(frozen=True)
class Parameter:
    """Parameter of an effect: its name in an ice file, its SI unit, its meaning in a line.

    Parameters
    ----------
    symbol : symbol in `EffectCard.equation`, as LaTeX; empty if absent
    low, high : bounds outside which the effect is not valid
    default : value if it is missing in an ice file; None makes it compulsory
    neutral : value at which the effect does nothing, if this parameter alone can switch it off
    held : true if it keeps the value of an ice file when that ice is fitted to throws, because it
        identifies the place or the stone of the effect
    axis : axis of the sheet frame, if the parameter is the component of a vector along it; it has
        the opposite sign from the other end of the sheet
    scales : push of other effects that the parameter multiplies; without such a push it cannot be
        measured
    usual : its value on the ice of a usual rink, for effects of every ice; otherwise None
    spread : standard deviation of the parameter among the ices of rinks, about the given or usual
        value; None if unknown
    observed_with : parameter of the same effect, in the same unit; agents observe the sum of both;
        empty for a separate number
    """

    name: str
    unit: str
    meaning: str
    symbol: str = ""
    _: KW_ONLY
    low: float = -math.inf
    high: float = math.inf
    default: float | None = None
    neutral: float | None = None
    held: bool = False
    axis: Literal["x", "y"] | None = None
    scales: Push | None = None
    usual: float | None = None
    spread: float | None = None
    observed_with: str = ""

    def within(self, low: float, high: float, **others: Any) -> Parameter:
        """Return the same with these bounds, and with other fields as given."""
        return replace(self, low=low, high=high, **others)


@dataclass(frozen=True, kw_only=True)
class Variant:
    """Another form of an effect, with its own parameter. Discovery tries it separately.

    Parameters
    ----------
    parameter : the parameter that switches it on
    readable, evidence, scope, pushes, needs, shown_over : as in `EffectCard` and `Search`
    """

    parameter: str
    readable: str
    evidence: str
    scope: Scope = "within throws"
    pushes: tuple[Push, ...] = ("along",)
    needs: tuple[Need, ...] = ()
    shown_over: Variable = "speed"

    @property
    def words(self) -> str:
        """Name in a sentence."""
        return self.readable


@dataclass(frozen=True, kw_only=True)
class Search:
    """Search for an effect in measured throws. The defaults suit most effects.

    Parameters
    ----------
    needs : required content of a session for the effect to be visible
    first : parameters that are fitted first; by default those with a neutral value that are not
        among `shape`
    shape : parameters that shape the effect and are fitted once its strength is known; by default
        those with a default value and without a neutral one
    other_start : values from which the effect is fitted again, shape included, if its usual shape
        gains nothing
    finer : values from which finer forms of the fitted effect begin, given its present ones; the
        parameters that they name are fitted too, if that is worth it
    variants : other forms of the effect
    stone : parameter that identifies its stone; the effect is then tried for each stone
    area : parameters with the least and greatest x and the least and greatest y of the rectangle in
        which the effect acts; the rectangle is then searched
    mistaken_for : model part that absorbs the effect in a fit without it: the ``map`` of friction,
        or a systematic error of the ``camera``
    """

    needs: tuple[Need, ...] = ()
    first: tuple[str, ...] | None = None
    shape: tuple[str, ...] | None = None
    other_start: Values | None = None
    finer: Starts = _none
    variants: tuple[Variant, ...] = ()
    stone: str | None = None
    area: tuple[str, str, str, str] | None = None
    mistaken_for: tuple[Literal["map", "camera"], ...] = ()

    @property
    def named(self) -> set[str]:
        """Return all parameters that it names."""
        return {
            *(self.first or ()),
            *(self.shape or ()),
            *(self.other_start or ()),
            *(variant.parameter for variant in self.variants),
            *((self.stone,) if self.stone else ()),
            *(self.area or ()),
        }


@dataclass(frozen=True, kw_only=True)
class EffectCard:
    """Effect of the ice, the stone, the air or the measurement.

    Parameters
    ----------
    name : name in ice files and reports
    title : title for people
    readable : name in a sentence, such as "the model lacks friction that follows the speed"; the
        name without underscores by default
    formula : formula in a line of text, with the names of the parameters
    equation : the same as LaTeX, with their symbols, for pages that draw it; empty if absent
    parameters : in the order in which the kernel reads theta
    source : source of the form
    validity : range of validity
    evidence : sign of it in measured tracks
    measured_by : advice to a team on measuring it
    acts : ``friction``, a factor on μ that is the same for every contact of the band;
        ``contact_friction``, a factor on μ that follows the slip of each contact; ``motion``, a
        separate acceleration or a factor on the others; ``map``, the friction map itself, which the
        engines read without a kernel; ``measurement``, an error of the camera's report without
        effect on the stone; ``nothing``, a remark in an ice file
    dissipative : true if it can only remove energy from the stone
    kernel : kernel compiled by `effect_kernel`, which reads and writes the places of
        `physics.motion`; None for effects that do not act on the stone
    of_speed_and_spin : true if the kernel reads only the speed, the spin and the slips, so that
        engines may tabulate it
    displacement : for an effect of the measurement, the difference of reported from true positions
    x_breaks, y_breaks : coordinates at which the effect is not smooth, given its parameters [m]
    scope : ``within throws`` if a single throw can show it, ``between throws`` if it changes the
        friction of whole throws
    pushes : directions of the acceleration that it adds or removes: along the travel, to its
        left, of the rotation, or fixed in the sheet
    search : its search in measured throws
    shown_over : variable over which figures show it
    turned : function that converts its parameters to the view from the other end of the sheet; by
        default those with an `axis` change their sign
    observed : scales of the parameters in agents' observations, each the value that counts as 1; a
        missing parameter has a scale from its bounds
    observed_order : place of these numbers among those of other effects
    observed_times : maximum number of effects of this name in the observation of one ice
    """

    name: str
    title: str
    readable: str = ""
    formula: str
    equation: str = ""
    parameters: tuple[Parameter, ...]
    source: str
    validity: str
    evidence: str
    measured_by: str = "throw more stones"
    acts: Acts
    dissipative: bool
    kernel: Any = field(default=None, repr=False)
    of_speed_and_spin: bool = False
    displacement: Displacement | None = field(default=None, repr=False)
    x_breaks: Breaks = _none
    y_breaks: Breaks = _none
    scope: Scope = "within throws"
    pushes: tuple[Push, ...] = ("along",)
    search: Search = field(default_factory=Search)
    shown_over: Variable = "speed"
    observed: Values = field(default_factory=dict[str, float])
    observed_order: int = 1_000
    observed_times: int = 1
    turned: Turned | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        partners = {p.observed_with for p in self.parameters if p.observed_with}
        unknown = sorted((self.search.named | self.observed.keys() | partners) - self._names)
        says = f"the card of {self.name}"
        if unknown:
            raise InputError(f"{says} names {unknown[0]!r}, which is not one of its parameters")
        wants_kernel = self.is_physical and self.acts != "map"
        if wants_kernel != (self.kernel is not None):
            wants = "wants a" if wants_kernel else "takes no"
            raise InputError(f"{says}: acts={self.acts!r} {wants} kernel")

    @property
    def _names(self) -> set[str]:
        return {parameter.name for parameter in self.parameters}

    @property
    def is_physical(self) -> bool:
        """True if it acts on the stone."""
        return self.acts not in ("measurement", "nothing")

    @property
    def words(self) -> str:
        """Name in a sentence."""
        return self.readable or self.name.replace("_", " ")

    @property
    def neutral(self) -> dict[str, float]:
        """Return the parameters that can switch it off, at the values that do."""
        return {p.name: p.neutral for p in self.parameters if p.neutral is not None}

    @property
    def usual(self) -> dict[str, float]:
        """Return parameters of the effect on the ice of a usual rink; empty if not every ice has
        it.
        """
        return {p.name: p.usual for p in self.parameters if p.usual is not None}

    @property
    def shape(self) -> tuple[str, ...]:
        """Return parameters that shape it and are fitted once its strength is known."""
        if self.search.shape is not None:
            return self.search.shape
        return tuple(p.name for p in self.parameters if p.neutral is None and p.default is not None)

    @property
    def first(self) -> tuple[str, ...]:
        """Return parameters that are fitted first."""
        if self.search.first is not None:
            return self.search.first
        return tuple(name for name in self.neutral if name not in self.shape)

    @property
    def observed_parameters(self) -> list[Parameter]:
        """Return parameters in agents' observations, each as a separate number."""
        return [parameter for parameter in self.parameters if not parameter.observed_with]

    def from_other_end(self, given: Values) -> Values:
        """Return parameters of the same effect, after a half-turn of the sheet frame."""
        if self.turned is not None:
            return self.turned(given)
        axes = {parameter.name for parameter in self.parameters if parameter.axis}
        return {name: -value if name in axes else value for name, value in given.items()}

    def parameter(self, name: str) -> Parameter:
        """Return the parameter of that name."""
        return next(p for p in self.parameters if p.name == name)

    def theta(self, given: Values) -> list[float]:
        """Return the kernel's parameter vector from an ice file's parameters.

        Raises
        ------
        InputError : an unknown, missing or out-of-bounds parameter
        """
        unknown = sorted(given.keys() - self._names)
        if unknown:
            names = ", ".join(parameter.name for parameter in self.parameters)
            raise InputError(
                f"effect {self.name} has no parameter {unknown[0]!r}; expected one of {names}"
            )
        values: list[float] = []
        for parameter in self.parameters:
            value = given.get(parameter.name, parameter.default)
            if value is None:
                raise InputError(f"effect {self.name} needs its parameter {parameter.name!r}")
            if not parameter.low <= value <= parameter.high:
                raise InputError(
                    f"effect {self.name}: {parameter.name} must be between {parameter.low:g} and "
                    f"{parameter.high:g} {parameter.unit}, got {value:g}"
                )
            values.append(float(value))
        return values
