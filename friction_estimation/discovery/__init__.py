"""Where measurement and model disagree, and what is missing: the discovery of effects.

Noise is learnt first (`noise`), the baseline is refitted to the same throws (`baseline`, `fit`),
beside what a film's camera does to all of them (`misplacement`); all candidates are screened
(`candidates`, `screening`, `patches`), added one by one (`selection`), proved throw by throw
(`proof`) and accepted on throws that nothing was fitted to (`acceptance`).
What no candidate explains is described by what it follows (`unknown`).
"""
