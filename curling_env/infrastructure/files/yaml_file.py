"""Settings from YAML files: plain lists, mappings, numbers and text."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, cast

from curling_env.errors import InputError
from curling_env.infrastructure.files import limits
from curling_env.infrastructure.files.reading import read_text


def read_yaml(path: str | Path) -> Any:
    """The document of a YAML file; needs PyYAML (the extra `train`).

    Raises
    ------
    InputError : unreadable, not YAML, too large with its aliases written out, or a number that is
        not finite
    """
    import yaml

    text = read_text(path, most=limits.MAX_YAML_BYTES)
    try:
        document = yaml.safe_load(text)
        size = _size(document, {}, 0)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = None if mark is None else f"line {mark.line + 1}"
        raise InputError("is not YAML", source=path, where=place) from error
    except InputError as error:
        raise InputError(error.problem, source=path) from error
    except RecursionError as error:
        raise InputError("is nested too deep", source=path) from error
    except (ValueError, TypeError, AttributeError, OverflowError) as error:
        # PyYAML lets the faults of what it makes out of text through.
        raise InputError(f"is not YAML that can be read: {error}", source=path) from error
    if size > limits.MAX_YAML_NODES:
        raise InputError(
            f"has more than {limits.MAX_YAML_NODES} entries with its aliases written out",
            source=path,
        )
    return document


def _size(value: Any, known: dict[int, int], depth: int) -> int:
    """Entries with aliases written out; the same list is counted once and added each time."""
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError("holds a number that is not finite")
    if isinstance(value, int) and abs(value) > 10**limits.MAX_DIGITS:
        raise InputError(f"holds a number of more than {limits.MAX_DIGITS} digits")
    if isinstance(value, set):
        raise InputError("holds a set; expected lists and mappings")
    if not isinstance(value, list | dict):
        return 1
    if depth > limits.MAX_JSON_DEPTH:
        raise InputError("is nested too deep")
    inside = cast("list[Any]", value if isinstance(value, list) else [*value, *value.values()])
    if id(cast("object", value)) not in known:
        known[id(cast("object", value))] = 1 + sum(_size(v, known, depth + 1) for v in inside)
    return known[id(cast("object", value))]
