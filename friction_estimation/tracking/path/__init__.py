"""From places in single frames to a path: prediction, heading, smoothing, honest errors."""
