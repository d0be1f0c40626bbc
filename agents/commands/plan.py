"""`curling plan`: find the best throw for a target or a task."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from curling_env.commands.cli import (
    DeliveryOption,
    IceOption,
    SeedOption,
    UnitsOption,
    Writes,
    conclude,
)
from curling_env.errors import InputError
from curling_env.units import Units


def plan(
    ice: IceOption,
    target: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y",
            help="Place where the stone should rest, or mark of a task, sheet frame [m]; the tees "
            "are 0,17.3735 and 0,-17.3735.",
        ),
    ] = None,
    task: Annotated[
        str | None,
        typer.Option(
            metavar="TASK",
            help="draw, guard, takeout, hit-and-stay, peel, freeze, score (the most points), or a "
            "task of your own: the name that a package declares, or module:Class.",
        ),
    ] = None,
    stones: Annotated[
        Path | None,
        typer.Option(
            metavar="S.json",
            help='Stones on the sheet: [{"x": 0.3, "y": 15.2, "team": "own"}, …]; a team is own or '
            "other, and needed for score; `curling stones --own red` writes such a file.",
        ),
    ] = None,
    skill: Annotated[
        str,
        typer.Option(
            help="Execution error of the player: none, elite, digital-curling, champion, "
            "championship, club, or the file of an athlete from `curling athletes`."
        ),
    ] = "elite",
    spin: Annotated[
        str | None,
        typer.Option(
            metavar="S[,S…]",
            help="Spins to try [rad/s], counter-clockwise positive; by default 0.5 to 1.6 of both "
            "handles.",
        ),
    ] = None,
    x: Annotated[float, typer.Option("--x", help="Offset of the release, to the right [m].")] = 0.0,
    delivery: DeliveryOption = "hog-line",
    picture: Annotated[
        Path | None,
        typer.Option(metavar="P.png", help="Draw the path and where the stone comes to rest."),
        Writes(kinds=("picture",)),
    ] = None,
    units: UnitsOption = Units.METRES,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print only the JSON, without the call.")
    ] = False,
    seed: SeedOption = 0,
) -> None:
    """Find the best throw for a target or a task.

    It simulates throws of both handles and takes the one with the best expected result, given the
    player's execution error (--skill) and the standard errors of the ice. A terminal gets
    the call in a curler's words, programs JSON (--json, or where stdout is no terminal).

    With --target alone the stone comes to rest there without touching another. With --task the
    throw may move stones, and is judged as in CurlingSheet-v0:

    \b
        draw          rest in the house, at the target or on the button
        guard         rest in front of the house, at the target or on the centre line
        takeout       put a stone out of play
        hit-and-stay  the same, and the thrown stone stays in play
        peel          the same, and the thrown stone leaves play too
        freeze        rest against a stone without driving it back
        score         the most points, as the stones lie after the throw

    A takeout or a freeze is about the stone nearest to the target, or without a target about the
    opponents' best stone; without --stones there is one at the target. For score, every stone must
    say its team. expected_miss_m is a distance as miss_means says, chance_of_success what
    success_means says; a takeout succeeds or not, and how far its stones run is no miss of it. The
    second choice is another shot: of the other handle, another weight, or swept otherwise.

    The end played to is the half of the sheet in which the target lies. speed [m/s], angle [rad,
    counter-clockwise from the direction of play] and spin [rad/s] can be passed to `curling throw`
    as they are; sweep says when to sweep, if the ice file has that effect. spread is the scatter by
    the player and the ice together, spread_of_the_hand and spread_of_the_ice by each alone, and
    spread_of_the_map by the ice's map without its effects. remarks says what the ice lacks, and
    believed which effects the throw depends on that no throw has measured.

    \b
    Examples:
        curling plan --ice standard --target 0,17.3735
        curling plan --ice ice.json --target=-0.6,16.8 --skill club --picture plan.png
        curling plan --ice ice.json --task takeout --target 0.3,17.6 --picture hit.png
        curling plan --ice ice.json --task score --stones stones.json
    """
    from agents.planning import plan as find
    from agents.planning import plan_task
    from agents.planning.request import check_stones
    from agents.planning.stones_file import read_stones
    from curling_env.game.skill_file import load_skill
    from curling_env.ice import load_ice
    from curling_env.physics.slides import NO_OBSTACLES
    from curling_env.throw import delivery_named

    if target is None and task is None:
        raise InputError("say what is wanted: --target X,Y, or --task with or without a target")
    known = load_ice(ice)
    aim = None if target is None else _numbers(target, "--target", count=2)
    places, own = (NO_OBSTACLES, None) if stones is None else read_stones(stones)
    if stones is not None and task == "score":
        check_stones(known, places)
        places, own = read_stones(stones, teams_needed=True)
    tried = None if spin is None else _numbers(spin, "--spin")
    wanted: dict[str, Any] = {
        "stones": places,
        "own": own,
        "skill": load_skill(skill),
        "spins": tried,
        "x": x,
        "delivery": delivery_named(delivery),
        "seed": seed,
    }
    if task is None:
        assert aim is not None  # one of the two was given
        result = find(known, aim, **wanted)
    else:
        result = plan_task(known, task, aim, **wanted)
    if picture is not None:
        from agents.planning.plan_figure import draw_plan

        draw_plan(known, result, picture, units)
    sentences = [result.best.description.call_in(units), result.expectation(result.best, units)]
    sentences = [sentence for sentence in sentences if sentence] + result.remarks
    conclude(result.as_dict(), *sentences, as_json=as_json)


def _numbers(text: str, option: str, count: int | None = None) -> list[float]:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if not values or (count is not None and len(values) != count):
        shape = "X,Y" if count == 2 else "numbers with commas between them"
        raise InputError(f"expected {shape}, got {text!r}", source=option)
    return values
