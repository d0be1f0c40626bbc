"""Pebble wear with every throw: on the whole sheet, and along the stones' paths."""

from math import exp
from typing import Any

from curling_env.physics.compiled import effect_kernel
from curling_env.physics.effects.card import EffectCard, Parameter, Search, Variant
from curling_env.physics.motion import FRICTION, ORDER


@effect_kernel
def _kernel(motion: Any, theta: Any, push: Any) -> None:
    # Wear along paths is in the map when a stone is thrown, or in the friction of each contact: see
    # physics/wear.py.
    push[FRICTION] *= exp(theta[0] * motion[ORDER])


CARD = EffectCard(
    name="pebble_wear",
    title="Pebble wear",
    readable="pebble that wears from throw to throw",
    formula="μ → μ·exp(rate·n + along_path·(s_1 + … + s_n)) after n throws, of which throw i "
    "ran over the share s_i of the cell; under_contacts likewise, for each contact of the band",
    equation=r"\mu \to \mu \, \exp\left( r\,n + w \sum_{i=1}^{n} s_i \right), \quad "
    r"\mu_q \to \mu_q \, \exp\left( c \sum_{i=1}^{n} s_{iq} \right)",
    parameters=(
        Parameter(
            "rate",
            "1/throw",
            "relative change of friction per throw played; keener ice is negative",
            "r",
        ).within(-0.1, 0.1, default=0.0, neutral=0.0),
        Parameter(
            "along_path",
            "1/pass",
            "relative change of friction where the running band passed, for each pass",
            "w",
        ).within(-0.1, 0.1, default=0.0),
        Parameter(
            "under_contacts",
            "1/pass",
            "the same, but for each contact of the band on the ice under it",
            "c",
        ).within(-0.1, 0.1, default=0.0, observed_with="along_path"),
    ),
    source="0.2–0.5 % per pass at worn spots",
    validity="some tens of throws on one pebble; along paths wherever throws are played in turn",
    evidence="friction follows the number of throws rather than the clock",
    acts="friction",
    kernel=_kernel,
    scope="between throws",
    search=Search(
        shape=(),
        variants=(
            Variant(
                parameter="under_contacts",
                readable="pebble that wears where stones have run",
                evidence="friction follows the number of passes over the place, and a stone "
                "turns where one side is more worn",
                needs=("runs over the same ice",),
                shown_over="passes",
            ),
            Variant(
                parameter="along_path",
                readable="pebble that wears where stones have run, acting at their centres",
                evidence="friction follows the number of passes over the place",
                needs=("runs over the same ice",),
                shown_over="passes",
            ),
        ),
    ),
    shown_over="order",
    observed={"rate": 0.01, "along_path": 0.01},
    observed_order=7,
    dissipative=True,
)
