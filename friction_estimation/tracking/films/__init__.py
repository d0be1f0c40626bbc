"""Tracking of several films: one camera for a scene, and resumed work."""
