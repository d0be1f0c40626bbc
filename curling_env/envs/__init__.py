"""Gymnasium environments: thin adapters over the physics and the rules."""
