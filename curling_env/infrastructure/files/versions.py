"""Numbered file formats, and the steps that bring a file of an earlier number up to date."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

from curling_env.errors import InputError

Step = Callable[[dict[str, Any]], dict[str, Any]]


@dataclass(frozen=True, kw_only=True)
class FileFormat:
    """A format of JSON documents with a number, such as ``curling-ice/1``.

    Parameters
    ----------
    name : what stands before the number
    what : what people call such a file, with its article, for messages
    steps : the first makes a document of number 1 one of number 2, the second one of number 3, and
        so on; each gets a copy of the document's top level. A step that was released is never
        edited.
    numbered : whether the document must say its format; else one that does not is of number 1
    """

    name: str
    what: str
    steps: tuple[Step, ...] = ()
    numbered: bool = True

    @property
    def newest(self) -> str:
        """Name and number that are written."""
        return f"{self.name}/{len(self.steps) + 1}"

    def brought_up(self, document: Any) -> dict[str, Any]:
        """A document of any number as one of the newest, which it names.

        Parameters
        ----------
        document : what JSON gave; it is left as it is

        Raises
        ------
        InputError : it is of another format, or of a number that only a later release knows; its
            `source` is left to the caller
        """
        found: Any = None
        if isinstance(document, dict):
            unsaid = None if self.numbered else f"{self.name}/1"
            found = cast("dict[str, Any]", document).get("format", unsaid)
        name, _, number = found.partition("/") if isinstance(found, str) else ("", "", "")
        if name != self.name or not (number.isascii() and number.isdecimal()) or len(number) > 9:
            raise InputError(
                f"expected {self.what} of format {self.newest!r}, found {str(found)[:40]!r}"
            )
        if not 1 <= int(number) <= len(self.steps) + 1:
            raise InputError(
                f"format {found!r} is not known here: this release reads {self.what} up to "
                f"{self.newest!r}"
            )
        current = dict(cast("dict[str, Any]", document))
        for step in self.steps[int(number) - 1 :]:
            current = step(current)
        return {**current, "format": self.newest}
