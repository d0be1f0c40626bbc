"""Documents (JSON, YAML) checked against schemas, with the place of the first error.

A schema is a `Document` with types, bounds and units; msgspec does the checking. The tests generate
documents from the same schemas.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar, cast

import msgspec

from curling_env.errors import InputError

Form = TypeVar("Form")


class Document(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """Base of schemas: every field by its name, and no others."""


def within(low: float, high: float, unit: str = "") -> msgspec.Meta:
    """Return the bounds of a number for ``Annotated[float, within(...)]``, far beyond measured
    values.

    Parameters
    ----------
    low, high : bounds, both allowed
    unit : unit of the number, for readers of the schema
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


@dataclass(frozen=True, kw_only=True)
class FileFormat:
    """A format of JSON documents.

    Parameters
    ----------
    name : name with number, such as ``curling-ice/1``
    what : name of such a file in messages, with its article
    numbered : true if a document must name its format
    """

    name: str
    what: str
    numbered: bool = True

    def accept(self, document: Any) -> dict[str, Any]:
        """Return a document of this format.

        Raises
        ------
        InputError : another format, or a number of a later release; its `source` is left to the
            caller
        """
        members = cast("dict[str, Any]", document if isinstance(document, dict) else {})
        unnamed = isinstance(document, dict) and not self.numbered
        found = members.get("format", self.name if unnamed else None)
        if found != self.name:
            own = self.name.partition("/")[0]
            known = isinstance(found, str) and re.fullmatch(rf"{own}/[0-9]{{1,9}}", found)
            raise InputError(
                f"unknown format {found!r}; expected {self.what} of format {self.name!r} or earlier"
                if known
                else f"expected {self.what} of format {self.name!r}, found {str(found)[:40]!r}"
            )
        return {**members, "format": self.name}


def checked(document: Any, form: type[Form], *, inside: str = "") -> Form:
    """Return a parsed document converted to a schema.

    Parameters
    ----------
    document : lists, dicts, text and numbers, as from JSON and YAML
    form : the schema
    inside : place of the document in its file, such as ``effects[3]``

    Raises
    ------
    InputError : the place and the expected value; its `source` is left to the caller
    """
    try:
        return msgspec.convert(document, form, strict=True)
    except msgspec.ValidationError as error:
        fault, _, path = str(error).partition(" - at `")
        path = _with_key(document, form, path.rstrip("`"), str(error))
        inner = path.removeprefix("$").removeprefix(".").replace("[...]", "")
        joint = "." if inside and inner and not inner.startswith("[") else ""
        where = f"{inside}{joint}{inner}" or None
        raise InputError(_in_words(fault, _at(document, path)), where=where) from error
    except UnicodeError as error:
        raise InputError(
            "contains half a character (a lone surrogate)", where=inside or None
        ) from error
    except (RecursionError, OverflowError) as error:
        raise InputError("nested too deeply", where=inside or None) from error


def _with_key(document: Any, form: Any, path: str, fault: str) -> str:
    """Replace msgspec's placeholder ``[...]`` in a path by the key, if only one key has the
    error.
    """
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
            if str(error) == fault:
                return f"{before}.{key[:60]}{after}"
        finally:
            known.clear()
            known.update(everything)
    return path


def _in_words(fault: str, value: Any) -> str:
    """Rephrase a message of msgspec about a value."""
    field = re.search(r"(missing required|unknown) field `(.*)`", fault, re.DOTALL)
    if field is not None:
        kind = "missing" if field[1].startswith("missing") else "unknown key"
        return f"{kind} {field[2][:60]}"
    length = re.fullmatch(r"Expected `array` of length (>= |<= )?(\d+)(?:, got (\d+))?", fault)
    if length is not None:
        bound = {">= ": "at least ", "<= ": "at most "}.get(length[1] or "", "")
        return f"expected {bound}{length[2]} entries, found {length[3] or len(value or ())}"
    found = re.fullmatch(r"Expected `(.*?)`(?:, got `(.*?)`)?( .*)?", fault, re.DOTALL)
    if found is None:
        return fault[:1].lower() + fault[1:160]
    kinds = [_NAMES.get(part.strip(), part.strip()) for part in found[1].split("|")]
    expected = " or ".join(kind for kind in kinds if kind != "null") or "null"
    bound = (found[3] or "").replace(">=", "of at least").replace("<=", "of at most")
    given = _NAMES.get(found[2] or "", found[2]) or repr(value)
    if isinstance(value, list | dict) and not found[2]:
        given = f"{len(cast('list[Any]', value))} members"
    return f"expected {expected}{bound}, found {given if len(given) <= 40 else given[:37] + '...'}"


def _at(document: Any, path: str) -> Any:
    """Return the value at a path such as ``$.friction.mu[3][4]``; None if absent."""
    value: Any = document
    for name, index in re.findall(r"\.([^.\[]+)|\[(\d+)\]", path):
        try:
            value = value[name] if name else value[int(index)]
        except (KeyError, IndexError, TypeError):
            return None
    return value
