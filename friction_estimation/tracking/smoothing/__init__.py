"""From measurements to tracks, with errors and warnings."""
