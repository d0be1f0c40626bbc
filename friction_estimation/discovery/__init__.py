"""Discovery of effects: where measurement and model disagree, and what the model lacks.

The noise of the tracks is learnt and the baseline is fitted to the same throws (`model`), beside
the systematic errors of the camera. Candidates are scored, fitted and chosen one by one (`search`),
then tested throw by throw and on throws that nothing was fitted to (`evidence`). A discrepancy that
no candidate explains is described by the variables that it follows.
"""
