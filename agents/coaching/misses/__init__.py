"""Causes of misses: the release, the ice that was misread, and the unexplained rest."""
