"""What a release must show: `make release-check`, the bill of materials, and the licences."""
