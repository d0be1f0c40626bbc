"""Stones that move at once and touch: their common steps, and what happens between contacts."""
