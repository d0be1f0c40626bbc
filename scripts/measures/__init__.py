"""The measures behind figures.json: one module for each group."""
