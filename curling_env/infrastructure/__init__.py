"""Files, workers and plug-ins: what all packages stand on, and what knows nothing of curling."""
