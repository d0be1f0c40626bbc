"""Remark in an ice file: measured throws show a residual that no effect explains."""

from curling_env.physics.effects.card import EffectCard

CARD = EffectCard(
    name="unknown",
    title="Something unknown",
    formula="none",
    parameters=(),
    source="discovery, from tracks that the other effects of the ice file do not explain",
    validity="the session it was found in",
    evidence="residuals that follow a variable and are not noise",
    acts="nothing",
    dissipative=False,
)
