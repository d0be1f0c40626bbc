"""`curling play`: play a game between two players."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from typer import Option

from curling_env.commands.options import (
    OUTPUT,
    DeliveryOption,
    IceOption,
    Measured,
    RecordFolder,
    SeedOption,
    SkillOption,
    grouped,
    numbers,
    option,
)
from curling_env.commands.terminal import print_json, print_remark, progress_bar, warn_about
from curling_env.typing import with_progress

if TYPE_CHECKING:
    from curling_env.game import GameSimulator

PlayerOption = Annotated[
    str,
    Option(
        metavar="AGENT",
        help="draw, rulebased, greedy, learned, search (search:500), module:Class or a model.",
    ),
]


@dataclass(frozen=True, kw_only=True)
class GameOptions:
    """Rules, ice and skill"""

    rules: str = option("world_curling_2024", "Rule set, such as mixed_doubles_2024.")
    ice: IceOption = "standard"
    skill: SkillOption = "elite"
    still: bool = option(False, "Keep the ice constant and all stones alike.", "--still")
    sweep: bool = option(True, "Sweep light stones, or none.")
    delivery: DeliveryOption = "hog-line"

    def simulator(self, ends: int | None, known_ice: str | None = None) -> GameSimulator:
        """Make a simulator of games.

        Parameters
        ----------
        ends : number of ends; by default that of the rules
        known_ice : ice as the players know it; by default the true one

        Raises
        ------
        InputError : unknown rules, skill or delivery, skills for another number of players, or an
            ice that cannot be read
        """
        from curling_env.errors import placed
        from curling_env.game import NO_EVOLUTION, TYPICAL_EVOLUTION, GameSimulator
        from curling_env.game.rules import rule_set
        from curling_env.game.simulator import skill_by_stone
        from curling_env.game.skill_file import load_skill
        from curling_env.infrastructure.threads import one_thread
        from curling_env.throw import delivery_named

        one_thread()
        rules = rule_set(self.rules, **({} if ends is None else {"ends": ends}))
        hands = [load_skill(name) for name in self.skill.split(",")]
        with placed(source="--skill"):
            each = skill_by_stone(rules, hands)
        simulator = GameSimulator(
            self.ice,
            known_ice=known_ice,
            rules=rules,
            skills=hands[0],
            throwers=(each, each),
            ice_evolution=NO_EVOLUTION if self.still else TYPICAL_EVOLUTION,
            sweeping=self.sweep,
            delivery=delivery_named(self.delivery),
        )
        warn_about(simulator.ice, simulator.known_ice)
        return simulator


@grouped
def play(
    home: PlayerOption,
    away: PlayerOption,
    ends: Annotated[
        int | None, Option(min=1, help="Number of ends; by default as in the rules.")
    ] = None,
    hammer: Annotated[
        Literal["home", "away", "lot"], Option(help="Team with the first hammer.")
    ] = "lot",
    start: Annotated[
        Path | None, Option("--from", metavar="GAME.jsonl", help="Recorded game to continue.")
    ] = None,
    at: Annotated[
        str, Option("--at", metavar="END,STONE", help="Its delivery to start from.")
    ] = "1,1",
    *,
    game: GameOptions,
    known_ice: Annotated[
        str | None, Option(metavar="ICE", help="Ice as the players know it.")
    ] = None,
    output: RecordFolder = None,
    film: Annotated[
        bool, Option("--film", help="Also make a film.", rich_help_panel=OUTPUT)
    ] = False,
    results: Measured,
    seed: SeedOption = 0,
) -> None:
    """Play a game between two players and print its line score.

    \b
    Examples:
        curling play --home rulebased --away draw --ends 8 -o runs/game
        curling play --home greedy --away rulebased --ice ice.json --seed 7 --json
        curling play --home rulebased --away greedy --rules mixed_doubles_2024
        curling play --home search --away search --from 0-1-1.jsonl --at 3,8

    The ice wears along the stones' paths and frosts over, stones differ slightly, sweepers sweep
    light stones, and players make execution errors. With -o the game is recorded, and game.html
    replays it in any browser; `curling replay` makes a film of the record. --from continues
    a recorded game from a delivery, by its rules. --skill A,B gives the players of a team different
    skills; in mixed doubles A throws the first and last stone. See docs/agents.md.
    """
    from agents.playing.board.recorded import rules_in, state_before
    from agents.playing.match import Match, PlayedGame
    from agents.playing.record import read_record, result_of, write_record
    from agents.playing.replay.film import write_film
    from agents.playing.replay.page import write_page
    from agents.playing.scoreboard import outcome, scoreboard
    from agents.playing.trained_player import player_from
    from curling_env.errors import InputError, placed
    from curling_env.game.rules import Team
    from curling_env.infrastructure.files.writing import make_directory, together

    if film and output is None:
        raise InputError("--film needs a directory: give -o DIR")
    players = (player_from(home), player_from(away))
    record = None if start is None else read_record(start)
    if record is not None:
        with placed(source=start):
            begun_by = rules_in(record)
        game, ends = replace(game, rules=begun_by.name), begun_by.ends
    simulator = game.simulator(ends, known_ice)
    state = None
    if record is not None:
        number, stone = numbers(at, "--at", "the end and the stone, such as 3,8", kind=int)
        with placed(source=start):
            state = state_before(record, simulator, number, stone, seed=seed)
    rules = simulator.rules
    last = None if hammer == "lot" else Team[hammer.upper()]
    paths = output is not None
    match = Match(simulator, players, seed=seed, last_stone=last, paths=paths, start=state)
    with progress_bar("stone") as progress:
        stones = rules.ends * rules.deliveries
        deliveries = tuple(with_progress(match, "playing", progress, stones))
    played = PlayedGame(players=players, deliveries=deliveries, game=match.game)
    if output is not None:
        folder = make_directory(output)
        with together(), progress_bar("stone") as progress:
            lines = write_record(folder / "game.jsonl", played, simulator, ice=game.ice, seed=seed)
            write_page(folder / "game.html", lines, results.units)
            if film:
                write_film(
                    folder / "game.mp4",
                    lines,
                    simulator.known_ice,
                    units=results.units,
                    progress=progress,
                )
        print_remark(
            f"recorded in {folder / 'game.jsonl'}; open {folder / 'game.html'} to watch it"
        )
    names = (players[0].name, players[1].name)
    if not results.as_json:
        print(scoreboard(played.game, names))
        print(outcome(played.game, names))
        return
    print_json(
        {
            "home": names[0],
            "away": names[1],
            "rules": rules.name,
            "ends": rules.ends,
            "ice": game.ice,
            "seed": seed,
            "deliveries": len(deliveries),
            **result_of(played.game),
        }
    )
