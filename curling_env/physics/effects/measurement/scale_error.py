"""Common factor on all lengths in the tracks."""

from curling_env.physics.effects.card import EffectCard, Parameter

CARD = EffectCard(
    name="scale_error",
    title="All lengths off by a factor",
    readable="lengths that are off by a factor",
    formula="reported x = factor·x",
    equation=r"\mathbf{p}_\text{reported} = \lambda \, \mathbf{p}",
    parameters=(
        Parameter("factor", "1", "measured length over the true one", r"\lambda").within(
            0.5, 2.0, neutral=1.0
        ),
    ),
    source="dimensional analysis: with x′ = λx and t′ = κt, friction becomes μ·λ/κ²",
    validity="one camera and one session",
    evidence="a known length on the ice; throws alone cannot show it, because friction absorbs it",
    acts="measurement",
    dissipative=False,
)
