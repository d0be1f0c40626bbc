"""The environments' own players, which need nothing but this package.

- `aiming`: from a shot in the sport's words to a throw on the known ice
- `draw`: every stone to the button
- `rulebased`: as a club skip is taught
"""
