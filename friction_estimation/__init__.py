"""From film to ice: calibration, tracking, and the friction map that the tracks reveal."""
