"""Sub-commands of `curling` about the sheet: throwing and simulating on known ice."""
