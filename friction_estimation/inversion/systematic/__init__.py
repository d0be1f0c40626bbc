"""What all throws err by together: the camera's ripple, its pose and its lens."""
