"""What the vector environments share: their arguments, and the form of their `info`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, cast

import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import iterate
from numpy.typing import NDArray

from curling_env.envs.options import brief, is_whole_number, whole_number
from curling_env.errors import InputError
from curling_env.typing import Flags


def autoreset_mode_of(mode: AutoresetMode | str) -> AutoresetMode:
    """When an episode that is over begins anew.

    Raises
    ------
    InputError : not one of Gymnasium's modes
    """
    found = next((m for m in AutoresetMode if mode in (m, m.value)), None)
    if found is None:
        modes = ", ".join(repr(m.value) for m in AutoresetMode)
        raise InputError(f"autoreset_mode must be one of {modes}, got {brief(mode)}")
    return found


def seeds_of(seed: Any, count: int) -> list[int | None]:
    """A seed for each environment.

    Parameters
    ----------
    seed : None, the first of consecutive seeds, or one (or None) for each
    count : number of environments

    Raises
    ------
    InputError : something else
    """
    if seed is None:
        return [None] * count
    if is_whole_number(seed):
        first = whole_number("seed", seed, least=0)
        return [first + k for k in range(count)]
    if isinstance(seed, str | Mapping) or not isinstance(seed, Iterable):
        raise InputError(
            f"seed must be a whole number, or one for each of {count} environments, got "
            f"{brief(seed)}"
        )
    each: list[Any] = list(cast("Iterable[Any]", seed))
    if len(each) != count:
        raise InputError(f"expected a seed for each of {count} environments, got {len(each)}")
    return [None if one is None else whole_number("seed", one, least=0) for one in each]


def reset_mask_of(mask: Any, count: int) -> Flags:
    """The environments that a `reset` begins anew: all by default.

    Raises
    ------
    InputError : not a boolean for each environment, one of them True
    """
    if mask is None:
        return np.ones(count, dtype=np.bool_)
    mask = np.asarray(mask)
    if mask.shape != (count,) or mask.dtype != np.bool_ or not mask.any():
        raise InputError(
            f"reset_mask must have a boolean for each of {count} environments, one of them True"
        )
    return mask.copy()


def masked(facts: Mapping[str, Any], mask: Flags, *, whole: bool = False) -> dict[str, Any]:
    """Facts in Gymnasium's form: for each name an array over all environments, and a mask.

    Parameters
    ----------
    facts : arrays by name, with a row for each environment in the mask; or mappings of such
    mask : (n,) the environments that the facts belong to
    whole : whether the arrays hold a row for every environment instead
    """
    out: dict[str, Any] = {}
    for name, value in facts.items():
        if isinstance(value, Mapping):
            out[name] = masked(cast("Mapping[str, Any]", value), mask, whole=whole)
        else:
            shape = (len(mask), *value.shape[1:])
            empty = np.empty if value.dtype == object else np.zeros
            out[name] = empty(shape, dtype=value.dtype)
            out[name][mask] = value[mask] if whole else value
        out[f"_{name}"] = mask.copy()
    return out


def objects(values: Sequence[Any]) -> NDArray[Any]:
    """An array of objects, which may be tuples."""
    array = np.empty(len(values), dtype=object)
    for k, value in enumerate(values):
        array[k] = value
    return array


def unmasked(facts: Mapping[str, Any]) -> dict[str, Any]:
    """The arrays of facts in Gymnasium's form, without their masks."""
    return {name: value for name, value in facts.items() if not name.startswith("_")}


def rows_of(space: Any, actions: Any, count: int) -> list[Any]:
    """The action of each environment.

    Raises
    ------
    InputError : actions of another shape
    """
    shape = np.shape(actions)
    if shape != space.shape:
        raise InputError(f"expected actions of shape {space.shape} for {count} ends, got {shape}")
    return list(iterate(space, np.asarray(actions)))
