"""Common factor on all times in the tracks."""

from curling_env.physics.effects.card import EffectCard, Parameter

CARD = EffectCard(
    name="frame_rate_error",
    title="All times off by a factor",
    readable="times that are off by a factor",
    formula="reported t = factor·t",
    equation=r"t_\text{reported} = \kappa \, t",
    parameters=(
        Parameter("factor", "1", "measured time over the true one", r"\kappa").within(
            0.5, 2.0, neutral=1.0
        ),
    ),
    source="dimensional analysis: with x′ = λx and t′ = κt, friction becomes μ·λ/κ²",
    validity="one camera and one session",
    evidence="an interval by a clock; throws alone cannot show it, because friction absorbs it",
    acts="measurement",
    dissipative=False,
)
