"""Table of published measurements of ice, stones and play, compared with ours.

python scripts/validation.py                  the table as text
python scripts/validation.py --json           JSON list of rows, each with `ice` (null: any)
python scripts/validation.py --pictures docs/pictures/validation
python scripts/validation.py --shots Stones.csv --hands all.skill.json    with rows of mixed doubles

docs/validation.md describes every row, docs/validation-hands.md those of hands and strategy,
docs/championships.md those of mixed doubles, which need a table of championship shots.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from curling_env.commands.cli import print_json, print_remark
from curling_env.errors import CurlingError
from curling_env.ice import load_ice
from curling_env.infrastructure.files.writing import make_directory
from curling_env.validation import ICE_ROWS, OTHER_ROWS, Comparison, Row, Shots, compare
from curling_env.validation.table import as_text, in_words, preset_of

PAPER = "Estimation of Curling Sheet Friction Factor by Pixelization, tables 3 and 4"
ICES = ("standard", "fitted", "club", "fcv1")
PAPER_SEED = 2019
HANDS = Path(__file__).parent / "measures" / "hands.json"
"""Ends of `search` against itself beside those of championships; docs/validation-hands.md."""

GRADE_ERROR = 3.0
"""Maximum standard error of the shares of grades of a task that is used [percentage points]."""


@cache
def _paper_errors() -> dict[int, float]:
    """Return the mean error of μ in the paper's experiment by the number of pitches [%]."""
    from measures.inference import paper

    found = paper()
    return {pitches: found[f"error_{pitches}"] for pitches in (1, 5)}


@cache
def _flow_misses() -> dict[tuple[str, str], float]:
    from measures.flow import flow_misses

    return flow_misses(np.random.default_rng(PAPER_SEED))


def _pyramid_over_plain(_: Shots, stretch: str) -> float:
    misses = _flow_misses()
    return misses["pyramidal", stretch] / misses["plain", stretch]


PAPER_ROWS: tuple[Row, ...] = (
    *(
        Row(
            name=f"mean error of μ, {pitches} pitch{'' if pitches == 1 else 'es'} of 1.6 m/s",
            part="the paper",
            published=f"{printed} %",
            low=0.0,
            high=printed,
            unit="%",
            source=f"{PAPER}; its figure {figure}",
            value=lambda _, pitches=pitches: _paper_errors()[pitches],
            about="Any method's bound at 5 mm of noise and 30 frames a second: "
            f"{bound} %. As good as printed, or better, agrees.",
            depends_on_ice=False,
        )
        for pitches, printed, figure, bound in ((1, 0.631, 9, 0.119), (5, 0.349, 10, 0.053))
    ),
    Row(
        name="before mid-sheet, miss of pyramidal flow over that of plain flow",
        part="the paper",
        published="about 1",
        low=0.8,
        high=1.25,
        unit="1",
        source="the paper's figure 6, a and c: 'similar results'",
        value=partial(_pyramid_over_plain, stretch="before mid-sheet"),
        depends_on_ice=False,
    ),
    Row(
        name="after mid-sheet, miss of pyramidal flow over that of plain flow",
        part="the paper",
        published="below 1",
        low=0.0,
        high=1.0,
        unit="1",
        source="the paper's figure 6, b and d: the points differ after the centre line",
        value=partial(_pyramid_over_plain, stretch="after mid-sheet"),
        depends_on_ice=False,
    ),
)


def _hands_rows() -> Iterator[Row]:
    """Return rows of hands and strategy, with the stored results of 1,066 games."""
    for row in json.loads(HANDS.read_text(encoding="utf-8")):
        value, why = row.pop("value"), row.pop("why")
        yield Row(
            **row,
            value=lambda _, value=value: value,
            why={"any": why} if why else {},
            depends_on_ice=False,
        )


ROWS_OF_NO_ICE: tuple[Row, ...] = (*OTHER_ROWS, *PAPER_ROWS, *_hands_rows())
"""Rows that do not depend on the ice."""


def doubles_rows(shots: Path, hands: str, ends: int) -> tuple[Row, ...]:
    """Rows of mixed doubles: ends of `search` and grades, beside a table of championship shots.

    Parameters
    ----------
    shots : the table
    hands : name or file of the skill of both teams
    ends : number of ends that are played
    """
    from agents.shots.grades import held_out_score
    from agents.shots.table import read_shots
    from agents.shots.world import EndsComparison, played_ends, real_ends
    from curling_env.game.skill_file import load_skill

    table = read_shots(shots)

    @cache
    def beside() -> EndsComparison:
        played = played_ends(load_skill(hands), ends=ends)
        return EndsComparison(real=real_ends(table), played=played)

    def worst_grade(_: Shots) -> float:
        held = held_out_score(table.games)
        return max(off for off, error in held.off_by_task.values() if error < GRADE_ERROR)

    def row(name: str, low: float, high: float, unit: str, value: Any, published: str) -> Row:
        return Row(
            name=name,
            part="mixed doubles",
            published=published,
            low=low,
            high=high,
            unit=unit,
            source=f"table of championship shots, {len(table.games)} games",
            value=value,
            depends_on_ice=False,
        )

    return (
        row(
            "results of ends, worst class",
            0.0,
            4.0,
            "points",
            lambda _: beside().worst,
            "within 4 points",
        ),
        row(
            "results of ends, p of χ²",
            0.05,
            1.0,
            "1",
            lambda _: beside().chi_squared[2],
            "not distinguishable",
        ),
        row(
            "grades by task on held-out games, worst share",
            0.0,
            3.0,
            "points",
            worst_grade,
            "within 3 points",
        ),
    )


def tables(
    ices: Iterable[str] = ICES, more: Iterable[Row] = ()
) -> dict[str | None, list[Comparison]]:
    """Return the rows of each ice by name, under None those independent of the ice, with `more`."""
    found: dict[str | None, list[Comparison]] = {
        name: compare(load_ice(name), preset_of(name), ICE_ROWS) for name in ices
    }
    found[None] = compare(load_ice("standard"), "standard", (*ROWS_OF_NO_ICE, *more))
    return found


def as_documents(found: dict[str | None, list[Comparison]]) -> list[dict[str, Any]]:
    """Return the rows as one list, each with its ice."""
    return [{"ice": ice, **row.as_dict()} for ice, rows in found.items() for row in rows]


def main(
    ice: Annotated[
        list[str] | None, typer.Option(help="An ice file or a preset; repeat it for several.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="JSON instead of text.")] = False,
    shots: Annotated[
        Path | None, typer.Option(metavar="Stones.csv", help="Table of championship shots.")
    ] = None,
    hands: Annotated[
        str, typer.Option(metavar="SKILL", help="Hands, from `curling hands` on that table.")
    ] = "championship",
    ends: Annotated[int, typer.Option(min=10, help="Number of ends played beside it.")] = 600,
    pictures: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Draw the figures of docs/validation.md.")
    ] = None,
) -> None:
    """Print the table of published measurements."""
    if pictures is not None:
        from validation_figures import draw_all

        draw_all(make_directory(pictures))
        print_remark(f"figures in {pictures}")
        return
    found = tables(ice or ICES, () if shots is None else doubles_rows(shots, hands, ends))
    if as_json:
        print_json(as_documents(found))
        return
    for name, rows in found.items():
        title = "the same on every ice" if name is None else f"ice: {name}"
        print(f"{title}\n{'=' * len(title)}\n{as_text(rows)}\n\n{in_words(rows)}\n")


if __name__ == "__main__":
    try:
        typer.run(main)
    except CurlingError as error:
        sys.exit(f"validation: {error}")
