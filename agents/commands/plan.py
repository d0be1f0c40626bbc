"""`curling plan`: the best throw for a target or a task."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Option

from curling_env.commands.options import (
    DeliveryOption,
    IceOption,
    Measured,
    PictureOption,
    SeedOption,
    SkillOption,
    grouped,
    numbers,
)
from curling_env.errors import InputError


@grouped
def plan(
    ice: IceOption,
    target: Annotated[
        str | None, Option(metavar="X,Y", help="Target in the sheet frame [m].")
    ] = None,
    task: Annotated[
        str | None, Option(metavar="TASK", help="Task, see above, or module:Class.")
    ] = None,
    stones: Annotated[
        Path | None, Option(metavar="S.json", help="Stones, see docs/planning.md.")
    ] = None,
    skill: SkillOption = "elite",
    spin: Annotated[str | None, Option(metavar="S[,S…]", help="Spins to try [rad/s].")] = None,
    x: Annotated[float, Option("--x", help="Offset of the release, to the right [m].")] = 0.0,
    delivery: DeliveryOption = "hog-line",
    picture: PictureOption = None,
    seed: SeedOption = 0,
    *,
    results: Measured,
) -> None:
    """Find the best throw for a target or a task.

    \b
    Examples:
        curling plan --ice standard --target 0,17.3735
        curling plan --ice ice.json --target=-0.6,16.8 --skill club --picture plan.png
        curling plan --ice ice.json --task takeout --target 0.3,17.6
        curling plan --ice ice.json --task score --stones stones.json

    \b
    With --target alone the stone must touch no other. With --task it may move stones:
        draw, guard    rest in the house or before it; at the target, if there is one
        takeout        put a stone out of play: the nearest to the target, or the opponents' best
        hit-and-stay   the same, with the thrown stone left in play
        peel           the same, with the thrown stone out of play too
        freeze         rest against a stone without driving it back
        score          the most points; every stone must have its team

    The best expected result counts, given the player's execution error and the standard errors of
    the ice. docs/planning.md explains the fields of the JSON.
    """
    from agents.planning import plan_throw
    from agents.planning.request import check_stones
    from agents.planning.stones_file import count_doubtful, read_stones
    from curling_env.game.skill_file import load_skill
    from curling_env.ice import load_ice
    from curling_env.physics.slides import NO_OBSTACLES
    from curling_env.throw import delivery_named

    if target is None and task is None:
        raise InputError("nothing to plan: give --target X,Y, or --task with or without a target")
    known = load_ice(ice)
    aim = None if target is None else numbers(target, "--target", "X,Y")
    places, own = (NO_OBSTACLES, None) if stones is None else read_stones(stones)
    if stones is not None and task == "score":
        check_stones(known, places)
        places, own = read_stones(stones, teams_needed=True)
    form, any_count = "numbers separated by commas", range(1, 1000)
    wanted: dict[str, Any] = {
        "stones": places,
        "own": own,
        "skill": load_skill(skill),
        "spins": None if spin is None else numbers(spin, "--spin", form, counts=any_count),
        "x": x,
        "delivery": delivery_named(delivery),
        "seed": seed,
    }
    result = plan_throw(known, task or aim or "", aim, **wanted)
    if picture is not None:
        from agents.planning.plan_figure import draw_plan

        draw_plan(known, result, picture, results.units)
    best, units = result.best, results.units
    sentences = [best.description.call_in(units), result.expectation(best, units)]
    if stones is not None and (count := count_doubtful(stones)):
        sentences.append(
            f"ignored as doubtful: {count} of the stones in {stones}; check the picture from "
            "`curling stones --picture`"
        )
    results.show(result.as_dict(), *filter(None, sentences), *result.remarks)
