"""All stones of a film tracked as one model: one motion model, one association, one smoother.

`detections` lists what may be a stone in each sampled frame, `association` links these over the
whole film under `motion`, `measuring` fits each stone in every frame along its predicted path, and
`smoothing` runs the same model backwards.
"""
