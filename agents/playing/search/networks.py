"""Networks of the package, their training conditions, and the choice for a game.

`scripts/train_value_network.py NAME` trains one again.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from importlib.resources import as_file, files

from agents.learning.model_file import read_model
from agents.playing.search.value_network import FILE, ValueNetwork, network_from
from curling_env.game.rules import RuleSet, rule_set
from curling_env.ice import Ice, load_ice

_FOLDER = "agents.playing.search"


@dataclass(frozen=True, kw_only=True)
class TrainingConditions:
    """Training conditions of a network.

    Parameters
    ----------
    name : its name
    file : its file in this package
    ice : preset of the ice
    rules : name of the rules
    delivery : name of the delivery, see `curling_env.throw.DELIVERIES`
    skill : the usual players' execution error
    """

    name: str
    file: str
    ice: str
    rules: str
    delivery: str
    skill: str


NETWORKS = (
    TrainingConditions(
        name="standard",
        file=FILE,
        ice="standard",
        rules="world_curling_2024",
        delivery="hog-line",
        skill="elite",
    ),
    TrainingConditions(
        name="digital_curling",
        file="value_network_digital_curling.npz",
        ice="fcv1",
        rules="digital_curling",
        delivery="hack",
        skill="digital-curling",
    ),
    TrainingConditions(
        name="mixed_doubles",
        file="value_network_mixed_doubles.npz",
        ice="fcv1",
        rules="dc4_server_mixed_doubles",
        delivery="hack",
        skill="digital-curling",
    ),
)
"""Networks of the package."""


def network_for(rules: RuleSet, ice: Ice) -> ValueNetwork:
    """Return the package's network trained for ends most like those of a game.

    The number of stones and the placed ones count first, then the loss in collisions, the main
    difference between ices for the outcome of a position, and then the other rules.
    """

    def unlike(network: TrainingConditions) -> tuple[int, float, int]:
        other = rule_set(network.rules)
        stones = abs(other.stones - rules.stones) + (other.placed_stones != rules.placed_stones)
        restitution = round(abs(_restitution(network.ice) - ice.stone.restitution), 3)
        return stones, restitution, _different_rules(rules, other)

    return _network_in(min(NETWORKS, key=unlike).file)


def network_named(name: str) -> ValueNetwork:
    """Return the package's network of that name, one of `NETWORKS`."""
    return _network_in(next(known.file for known in NETWORKS if known.name == name))


def _different_rules(rules: RuleSet, other: RuleSet) -> int:
    """Return the number of rules that differ, except names and the number of ends."""
    names = [f.name for f in fields(RuleSet) if f.name not in ("name", "title", "ends", "throwers")]
    return sum(getattr(rules, name) != getattr(other, name) for name in names)


@cache
def _restitution(ice: str) -> float:
    return load_ice(ice).stone.restitution


@cache
def _network_in(file: str) -> ValueNetwork:
    with as_file(files(_FOLDER).joinpath(file)) as path:
        return network_from(read_model(path), path)
