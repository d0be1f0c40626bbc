"""The networks that the package has, what each was learnt for, and which one values a game.

`scripts/train_value_network.py NAME` learns one again.
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
class LearntFor:
    """What a network was learnt for.

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
    LearntFor(
        name="standard",
        file=FILE,
        ice="standard",
        rules="world_curling_2024",
        delivery="hog-line",
        skill="elite",
    ),
    LearntFor(
        name="digital_curling",
        file="value_network_digital_curling.npz",
        ice="fcv1",
        rules="digital_curling",
        delivery="hack",
        skill="digital-curling",
    ),
    LearntFor(
        name="mixed_doubles",
        file="value_network_mixed_doubles.npz",
        ice="fcv1",
        rules="dc4_server_mixed_doubles",
        delivery="hack",
        skill="digital-curling",
    ),
)
"""The package's networks."""


def network_for(rules: RuleSet, ice: Ice) -> ValueNetwork:
    """The package's network that was learnt for ends most like those of a game.

    The number of stones and the placed ones count first, then how much collisions lose, which is
    where ices differ most in what a position leads to, and then the other rules.
    """

    def unlike(network: LearntFor) -> tuple[int, float, int]:
        other = rule_set(network.rules)
        stones = abs(other.stones - rules.stones) + (other.placed_stones != rules.placed_stones)
        restitution = round(abs(_restitution(network.ice) - ice.stone.restitution), 3)
        return stones, restitution, _different_rules(rules, other)

    return _network_in(min(NETWORKS, key=unlike).file)


def network_named(name: str) -> ValueNetwork:
    """The package's network of that name, one of `NETWORKS`."""
    return _network_in(next(known.file for known in NETWORKS if known.name == name))


def _different_rules(rules: RuleSet, other: RuleSet) -> int:
    """How many rules of two sets differ; names and the number of ends are none."""
    names = [f.name for f in fields(RuleSet) if f.name not in ("name", "title", "ends", "throwers")]
    return sum(getattr(rules, name) != getattr(other, name) for name in names)


@cache
def _restitution(ice: str) -> float:
    return load_ice(ice).stone.restitution


@cache
def _network_in(file: str) -> ValueNetwork:
    with as_file(files(_FOLDER).joinpath(file)) as path:
        return network_from(read_model(path), path)
