"""Marking the ice in a camera's picture by hand: a small page in the user's own browser.

places.py    what can be marked: corners, and where lines meet
picking.py   what the marks mean: the camera, the paint drawn back, the top view
server.py    the page and its questions, on this machine only
"""
