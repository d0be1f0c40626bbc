"""Checks of a release: `make release-check`, the bill of materials, and the licences."""
