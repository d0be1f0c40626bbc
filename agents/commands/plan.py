"""`curling plan`: the throw that comes to rest where it is wanted."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curling_env.cli import IceOption, SeedOption, print_json, say
from curling_env.errors import InputError


def plan(
    ice: IceOption,
    target: Annotated[
        str,
        typer.Option(
            metavar="X,Y",
            help="Where the stone should rest, sheet frame [m]; the tees are 0,17.3735 and "
            "0,-17.3735.",
        ),
    ],
    stones: Annotated[
        Path | None,
        typer.Option(metavar="S.json", help='Stones that lie there: [{"x": 0.3, "y": 15.2}, …].'),
    ] = None,
    skill: Annotated[
        str,
        typer.Option(help="Who throws: none (exact), elite, champion or club."),
    ] = "elite",
    spin: Annotated[
        str | None,
        typer.Option(
            metavar="S[,S…]",
            help="Spins to try [rad/s], counter-clockwise positive; otherwise both handles at "
            "0.5 to 1.6.",
        ),
    ] = None,
    x: Annotated[
        float, typer.Option("--x", help="Where the stone crosses the hog line, to the right [m].")
    ] = 0.0,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="P.png", help="Draw the path and where the stone would come to rest."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Only the JSON, without the remark on stderr.")
    ] = False,
    seed: SeedOption = 0,
) -> None:
    """Find the throw that comes to rest at a target.

    Searches over simulated throws of both handles. Of all that get there without touching a stone
    it takes the one that forgives: with the smallest miss to expect from the player's errors
    (--skill) and from the map's own uncertainty. The answer is JSON on stdout; stderr says it in a
    curler's words.

    The half of the sheet the target lies in is the end played to. speed [m/s], angle [rad,
    counter-clockwise from the direction of play] and spin [rad/s] can be given to `curling throw`
    as they are.

    \b
    Examples:
        curling plan --ice standard --target 0,17.3735
        curling plan --ice ice.json --target=-0.6,16.8 --skill club --picture plan.png
    """
    from agents.planning import plan as find
    from agents.planning.search import SPINS
    from agents.planning.stones import read_stones
    from curling_env.ice import load_ice
    from curling_env.physics.slide import NO_OBSTACLES

    known = load_ice(ice)
    result = find(
        known,
        _numbers(target, "--target", count=2),
        stones=NO_OBSTACLES if stones is None else read_stones(stones),
        skill=skill,
        spins=SPINS if spin is None else _numbers(spin, "--spin"),
        x=x,
        seed=seed,
    )
    if picture is not None:
        from agents.planning.picture import draw_plan

        draw_plan(known, result, picture)
    if not as_json:
        say(result.best.words.call)
        if result.best.spread.miss.size > 1:
            say(f"expect to miss by {100 * result.best.expected_miss:.0f} cm")
    print_json(result.as_dict())


def _numbers(text: str, option: str, count: int | None = None) -> list[float]:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if not values or (count is not None and len(values) != count):
        shape = "X,Y" if count == 2 else "numbers with commas between them"
        raise InputError(f"expected {shape}, got {text!r}", source=option)
    return values
