"""Marking the ice in a camera's picture by hand, on a small page in the user's own browser.

`annotate` is what the clicks mean: the camera, the paint drawn back, the view from above; `page` is
what the page is answered, wherever it is served; `server` serves it alone, to this machine only.
"""
