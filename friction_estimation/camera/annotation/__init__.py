"""Marking of the ice in a camera's picture by hand, on a small page in the user's browser.

`annotate` evaluates the clicks: the camera, the projected paint, the view from above; `page`
answers the page's requests, independent of the server; `server` serves it separately, to this
machine only.
"""
