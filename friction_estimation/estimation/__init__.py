"""From measured paths to the ice they ran on: its friction map, its effects, and their errors."""
