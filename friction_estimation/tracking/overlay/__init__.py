"""Overlay of a track on its film."""
