"""Options of the environments as plain data: numbers, names, lists and mappings.

Every option that is an object may also be a mapping of its fields, so that a specification can be
written as JSON or YAML. An invalid option is reported in one line with the accepted values.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, fields
from numbers import Real
from typing import Any, TypeVar, cast

import numpy as np

from curling_env.errors import InputError
from curling_env.game import NO_EVOLUTION, TYPICAL_EVOLUTION, IceEvolution
from curling_env.game.rules import RuleSet, rule_set
from curling_env.throw import Delivery, Skill, delivery_named, skill_named
from curling_env.typing import Floats

Kind = TypeVar("Kind")


def brief(value: Any) -> str:
    """Return a value shortened for an error message."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def dataclass_from(kind: type[Kind], name: str, given: Any) -> Kind:
    """Make an object from a mapping of its fields, in which lists become tuples.

    Parameters
    ----------
    kind : its dataclass
    name : of the option, for messages
    given : a mapping, or such an object, which is returned as it is

    Raises
    ------
    InputError : something else, an unknown or a missing field, or an invalid value
    """
    if isinstance(given, kind):
        return given
    known = {field.name: field for field in fields(cast("Any", kind))}
    article = "an" if kind.__name__[0] in "AEIOU" else "a"
    accepted = f"{article} {kind.__name__} or a mapping of {', '.join(known)}"
    if not isinstance(given, Mapping):
        raise InputError(f"{name} must be {accepted}, got {brief(given)}")
    mapping = cast("Mapping[Any, Any]", given)
    unknown = sorted(str(key) for key in mapping if key not in known)
    if unknown:
        raise InputError(f"{name} has no {unknown[0]!r}; it must be {accepted}")
    missing = [
        key
        for key, field in known.items()
        if field.default is MISSING and field.default_factory is MISSING and key not in mapping
    ]
    if missing:
        raise InputError(f"{name} lacks {missing[0]!r}; it must be {accepted}")
    for key, value in mapping.items():
        if isinstance(value, bool) and known[key].type in ("float", "int"):
            raise InputError(f"{key} of {name} must be a number, got {value}")
    values: dict[str, Any] = {
        str(key): tuple(cast("list[Any]", value)) if isinstance(value, list) else value
        for key, value in mapping.items()
    }
    try:
        return kind(**values)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{name} must be {accepted}, got {brief(given)}") from error


def whole_number(name: str, value: Any, *, least: int | None = None) -> int:
    """Check a whole number with a minimum.

    Raises
    ------
    InputError : something else
    """
    if not is_whole_number(value) or (least is not None and value < least):
        bound = "" if least is None else f" of at least {least}"
        raise InputError(f"{name} must be a whole number{bound}, got {brief(value)}")
    return int(value)


def number(name: str, value: Any, *, above: float, most: float) -> float:
    """Check a number above a bound and at most another.

    Raises
    ------
    InputError : something else
    """
    if not isinstance(value, Real) or value is True or not above < float(value) <= most:
        raise InputError(
            f"{name} must lie above {above:g} and at most {most:g}, got {brief(value)}"
        )
    return float(value)


def floats_from(wanted: str, given: Any) -> Floats:
    """Convert a value to an array of numbers.

    Parameters
    ----------
    wanted : what it must be, as the beginning of a message
    given : anything

    Raises
    ------
    InputError : it holds something else than numbers
    """
    try:
        return np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{wanted}, got {brief(given)}") from error


def is_whole_number(value: Any) -> bool:
    """Return whether a value is a whole number of Python or NumPy; True and False are not."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def yes_or_no(name: str, value: Any) -> bool:
    """True or False.

    Raises
    ------
    InputError : something else
    """
    if type(value) not in (bool, np.bool_):
        raise InputError(f"{name} must be True or False, got {brief(value)}")
    return bool(value)


def one_of(name: str, value: Any, choices: Sequence[Any]) -> Any:
    """One of some values, such as names.

    Raises
    ------
    InputError : something else
    """
    for choice in choices:
        if type(value) is type(choice) and value == choice:
            return choice
    raise InputError(f"{name} must be {' or '.join(map(repr, choices))}, got {brief(value)}")


def skill_from(name: str, given: Any) -> Skill:
    """Return a player's execution error: from a name, a `Skill`, or a mapping of its standard
    deviations.
    """
    if isinstance(given, Mapping):
        given = dataclass_from(Skill, name, {"name": "own", **cast("Mapping[str, Any]", given)})
    return skill_named(given)


def players_from(name: str, given: Any) -> tuple[Skill, ...]:
    """Return execution errors of a team: one for all, or a sequence with one for each player."""
    if isinstance(given, Sequence) and not isinstance(given, str):
        return tuple(skill_from(name, one) for one in cast("Sequence[Any]", given))
    return (skill_from(name, given),)


def delivery_from(given: Any) -> Delivery:
    """Return the start of throws, from a name, a `Delivery`, or a mapping of its fields."""
    if isinstance(given, Mapping):
        return dataclass_from(Delivery, "delivery", given)
    return delivery_named(given)


def rules_from(given: Any, ends: int | None = None) -> RuleSet:
    """Return a set of rules, from a name, a `RuleSet`, or a mapping of a name and changes."""
    changes: dict[str, Any] = {} if ends is None else {"ends": ends}
    if isinstance(given, Mapping):
        mapping = dict(cast("Mapping[str, Any]", given))
        given, changes = mapping.pop("name", "world_curling_2024"), {**mapping, **changes}
        known = {field.name for field in fields(RuleSet)}
        unknown = sorted(str(key) for key in changes if key not in known)
        if unknown:
            raise InputError(
                f"unknown rule {unknown[0]!r}; expected one of {', '.join(sorted(known))}"
            )
    try:
        return rule_set(given, **changes)
    except TypeError as error:
        raise InputError(f"invalid rules: {error}") from error


EVOLUTIONS = {"none": NO_EVOLUTION, "typical": TYPICAL_EVOLUTION}
"""Changes of ice during a game, by name."""


def evolution_from(given: Any) -> IceEvolution:
    """Return the change of the ice, from a name, an `IceEvolution`, or a mapping of its fields."""
    if isinstance(given, str):
        if given not in EVOLUTIONS:
            raise InputError(
                f"ice_evolution must be one of {', '.join(EVOLUTIONS)}, an IceEvolution or a "
                f"mapping of {', '.join(f.name for f in fields(IceEvolution))}, got {given!r}"
            )
        return EVOLUTIONS[given]
    return dataclass_from(IceEvolution, "ice_evolution", given)


def reset_options(given: Any, known: Iterable[str]) -> dict[str, Any]:
    """Return the options of a `reset`, by name.

    Raises
    ------
    InputError : no mapping, or an unknown option
    """
    names = tuple(known)
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise InputError(
            f"options of reset must be a mapping of {', '.join(names)}, got {brief(given)}"
        )
    options = dict(cast("Mapping[Any, Any]", given))
    unknown = sorted(str(key) for key in options if key not in names)
    if unknown:
        raise InputError(f"unknown option {unknown[0]!r}; expected one of {', '.join(names)}")
    return options
