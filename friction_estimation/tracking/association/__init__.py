"""Detections linked to stones and throws."""
