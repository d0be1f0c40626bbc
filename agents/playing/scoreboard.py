"""Line score of a game, as on the board in a curling hall."""

from __future__ import annotations

from curling_env.game.rules import Game, Team

LAST_STONE = "*"
"""Mark of the team that had the hammer in the first end."""


def scoreboard(game: Game, names: tuple[str, str]) -> str:
    """Return the line score as text, with ends across and teams down.

    The hammer of the first end is marked; an end that was not needed has an X.
    """
    scores = [list(map(str, end)) for end in game.line_score]
    if game.conceded is not None or game.end is not None:
        scores += [["X", "X"]]
    scores += [["", ""]] * max(game.rules.ends - len(scores), 0)
    first = game.hammers[0] if game.hammers else game.last_stone
    width = max(len(name) for name in names) + 2
    heads = [str(k + 1) for k in range(len(scores))]
    lines = [" " * width + "".join(f"{head:>4}" for head in heads) + "   Total"]
    for team in Team:
        mark = LAST_STONE if team is first else " "
        row = "".join(f"{end[team]:>4}" for end in scores)
        lines.append(f"{names[team] + ' ' + mark:<{width}}{row}{game.score[team]:>8}")
    return "\n".join(lines)


def outcome(game: Game, names: tuple[str, str]) -> str:
    """Describe the result in a sentence."""
    if game.winner is None:
        return "A tie."
    ours, theirs = game.score[game.winner], game.score[game.winner.other]
    after = len(game.line_score)
    extra = after - game.rules.ends
    how = f"{ours} : {theirs}"
    if game.conceded is not None:
        return f"{names[game.winner]} wins {how}: {names[game.conceded]} concedes."
    if extra > 0:
        return f"{names[game.winner]} wins {how} after {extra} extra end{'s' * (extra > 1)}."
    return f"{names[game.winner]} wins {how}."
