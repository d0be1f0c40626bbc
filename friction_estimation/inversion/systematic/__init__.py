"""Errors that all throws share: a bias of the camera, and what the tracks state themselves."""
