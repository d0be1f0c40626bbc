"""Options that commands share, and groups of options as dataclasses."""

from __future__ import annotations

import copy
import functools
import inspect
import math
import re
from collections.abc import Callable, Container, Iterator
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_type_hints

from typer import Option
from typer.models import OptionInfo

from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import conclude
from curling_env.errors import InputError
from curling_env.units import Units, choose_units

Command = Callable[..., None]
Number = TypeVar("Number", int, float)
OUTPUT = "Output"
"""Title of the panel of options that choose the output."""


def grouped(command: Command) -> Command:
    """Return a command that takes the fields of its dataclass parameters as options.

    Typer takes plain parameters only. The options of a dataclass share a panel of the help, whose
    title is the first line of the dataclass's docstring.
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}
    parameters: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(command).parameters.items():
        if name in groups:
            parameters += _parameters_of(groups[name])
        else:
            kind = inspect.Parameter.KEYWORD_ONLY
            parameters.append(parameter.replace(kind=kind, annotation=hints[name]))

    def run(**given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{one.name: given.pop(one.name) for one in fields(group)})
        command(**given)

    flat: Any = functools.update_wrapper(run, command)
    del flat.__wrapped__  # its signature differs
    flat.__signature__ = inspect.Signature(parameters)
    flat.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return flat


def _parameters_of(group: Any) -> Iterator[inspect.Parameter]:
    hints = get_type_hints(group, include_extras=True)
    for one in fields(group):
        hint = Annotated[hints[one.name], one.metadata.get("option")]
        plain, *marks = get_args(hint)
        marks = [copy.copy(mark) for mark in marks]
        for mark in marks:
            if isinstance(mark, OptionInfo):
                mark.rich_help_panel = mark.rich_help_panel or (group.__doc__ or "").split("\n")[0]
        yield inspect.Parameter(
            one.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if one.default is MISSING else one.default,
            annotation=Annotated[(plain, *marks)],
        )


def option(default: Any, help: str, *names: str, **settings: Any) -> Any:
    """Declare a field of a group of options.

    Parameters
    ----------
    default, help : default value and text of the help
    names : names of the option, if not that of the field
    settings : further arguments of `typer.Option`
    """
    return field(default=default, metadata={"option": Option(*names, help=help, **settings)})


def output_to(metavar: str, help: str) -> OptionInfo:
    """Declare the option -o, --output."""
    return Option("-o", "--output", metavar=metavar, help=help, rich_help_panel=OUTPUT)


def numbers(
    text: str,
    option: str,
    form: str,
    *,
    counts: Container[int] = (2,),
    kind: Callable[[str], Number] = float,
) -> list[Number]:
    """Parse finite numbers separated by commas or an x.

    Parameters
    ----------
    option, form : name and expected form of the value, for the error
    counts : allowed numbers of values
    kind : int for whole numbers

    Raises
    ------
    InputError : the text does not have this form
    """
    values: list[Number] = []
    try:
        values = [kind(part) for part in re.split("[,x×]", text.lower())]
        fits = len(values) in counts and all(map(math.isfinite, values))
    except (OverflowError, ValueError):
        fits = False
    if not fits:
        raise InputError(f"expected {form}, got {text[:40]!r}", source=option)
    return values


@dataclass(frozen=True, kw_only=True)
class Results:
    """Output"""

    as_json: bool = option(False, "Print JSON, the default in a pipe.", "--json")

    def show(self, document: Any, *sentences: str) -> None:
        """Print the result of a command: sentences on a terminal, JSON for programs."""
        conclude(document, *sentences, as_json=self.as_json)


@dataclass(frozen=True, kw_only=True)
class Measured(Results):
    """Output"""

    units: Units = option(Units.METRES, "Units of displayed lengths.")

    def __post_init__(self) -> None:
        choose_units(self.units)


IceOption = Annotated[
    str,
    Option("--ice", metavar="ICE", help="Ice file or preset: standard, fitted, club, fcv1, paper."),
]
SeedOption = Annotated[int, Option("--seed", min=0, help="Seed of all randomness.")]
UnitsOption = Annotated[
    Units, Option("--units", help="Units of displayed lengths.", rich_help_panel=OUTPUT)
]
OutputFile = Annotated[Path, output_to("FILE", "File for the result."), Writes()]
TracksFile = Annotated[
    Path,
    output_to("FILE", "File for the tracks."),
    Writes(kinds=("tracks",), added_by="append"),
]
OutputDirectory = Annotated[Path, output_to("DIR", "Folder for the results."), Writes(folder=True)]
RecordFolder = Annotated[
    Path | None,
    output_to("DIR", "Folder for the record (game.jsonl) and its replay (game.html)."),
    Writes(folder=True),
]
PictureOption = Annotated[
    Path | None,
    Option("--picture", metavar="P.png", help="Also draw a picture.", rich_help_panel=OUTPUT),
    Writes(kinds=("picture",)),
]
DeliveryOption = Annotated[
    str,
    Option(help="Place of release: hog-line, tee-line, or hack (Digital Curling, ≤ 4 m/s)."),
]
SkillOption = Annotated[
    str,
    Option(
        metavar="SKILL",
        help="Skill: none, elite, champion, championship, club, digital-curling, or its file.",
    ),
]
WorkersOption = Annotated[
    str,
    Option(metavar="N|ray|ray://HOST:PORT", help="Number of local processes, or a Ray cluster."),
]
