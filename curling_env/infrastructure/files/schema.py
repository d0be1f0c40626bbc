"""Documents (JSON, YAML) checked against what they may hold, with the place of the first fault.

A schema is a `Document` with types, bounds and units; msgspec does the checking. The tests make
documents of their own from the same schemas.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, TypeVar, cast

import msgspec

from curling_env.errors import InputError

Form = TypeVar("Form")


class Document(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """Base of schemas: every field by its name, and no others."""


def within(low: float, high: float, unit: str = "") -> msgspec.Meta:
    """The bounds of a number, far beyond what is measured, for ``Annotated[float, within(...)]``.

    Parameters
    ----------
    low, high : bounds, both allowed
    unit : unit of the number, for whoever reads the schema
    """
    return msgspec.Meta(ge=low, le=high, description=unit)


Short = Annotated[str, msgspec.Meta(max_length=200)]
"""A name or a word."""
Text = Annotated[str, msgspec.Meta(max_length=4096)]
"""A remark or a path."""

_NAMES = {
    "float": "a number",
    "int": "a whole number",
    "str": "text",
    "bool": "true or false",
    "null": "null",
    "array": "a list",
    "object": "an object",
}


def checked(document: Any, form: type[Form], *, inside: str = "") -> Form:
    """A parsed document as the schema has it.

    Parameters
    ----------
    document : lists, dicts, text, numbers, as JSON and YAML give them
    form : the schema
    inside : the place of the document in its file, such as ``effects[3]``

    Raises
    ------
    InputError : the place and what was expected there; its `source` is left to the caller
    """
    try:
        return msgspec.convert(document, form, strict=True)
    except msgspec.ValidationError as error:
        said, _, path = str(error).partition(" - at `")
        path = _with_key(document, form, path.rstrip("`"), said)
        raise InputError(_in_words(said, document, path), where=_place(path, inside)) from error
    except UnicodeError as error:
        raise InputError("holds half a letter (a lone surrogate)", where=inside or None) from error
    except (RecursionError, OverflowError) as error:
        raise InputError("nested too deep", where=inside or None) from error


def _place(path: str, inside: str) -> str | None:
    inner = path.removeprefix("$").removeprefix(".").replace("[...]", "")
    joint = "." if inside and inner and not inner.startswith("[") else ""
    return f"{inside}{joint}{inner}" or None


def _with_key(document: Any, form: Any, path: str, said: str) -> str:
    """The path with the key that msgspec leaves out, ``[...]``, where one has the fault alone."""
    before, dots, after = path.partition("[...]")
    members = _at(document, before)
    if not dots or not isinstance(members, dict):
        return path
    known = cast("dict[str, Any]", members)
    everything = dict(known)
    for key, value in everything.items():
        known.clear()
        known[key] = value
        try:
            msgspec.convert(document, form, strict=True)
        except msgspec.ValidationError as error:
            if str(error) == f"{said} - at `{path}`":
                return f"{before}.{key[:60]}{after}"
        finally:
            known.clear()
            known.update(everything)
    return path


def _in_words(said: str, document: Any, path: str) -> str:
    """What msgspec says, in this project's words."""
    field = re.search(r"(missing required|unknown) field `(.*)`", said, re.DOTALL)
    if field is not None:
        kind = "missing" if field[1].startswith("missing") else "unknown key"
        return f"{kind} {field[2][:60]}"
    length = re.fullmatch(r"Expected `array` of length (>= |<= )?(\d+)(?:, got (\d+))?", said)
    if length is not None:
        bound = {">= ": "at least ", "<= ": "at most "}.get(length[1] or "", "")
        given = length[3] or len(_at(document, path) or ())
        return f"expected {bound}{length[2]} entries, found {given}"
    found = re.fullmatch(r"Expected `(.*?)`(?:, got `(.*?)`)?( .*)?", said, re.DOTALL)
    if found is None:
        return said[:1].lower() + said[1:160]
    kinds = [_NAMES.get(part.strip(), part.strip()) for part in found[1].split("|")]
    given = _NAMES.get(found[2] or "", found[2]) if found[2] else _value_at(document, path)
    bound = (found[3] or "").replace(">=", "of at least").replace("<=", "of at most")
    expected = " or ".join(kind for kind in kinds if kind != "null") or "null"
    return f"expected {expected}{bound}, found {given}"


def _value_at(document: Any, path: str) -> str:
    """The value at a path such as ``$.friction.mu[3][4]``, cut when it is long."""
    value = _at(document, path)
    if isinstance(value, list | dict):
        return f"{len(cast('list[Any]', value))} members"
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def _at(document: Any, path: str) -> Any:
    """What lies at a path; None where it leads nowhere."""
    value: Any = document
    for name, index in re.findall(r"\.([^.\[]+)|\[(\d+)\]", path):
        try:
            value = value[name] if name else value[int(index)]
        except (KeyError, IndexError, TypeError):
            return None
    return value
