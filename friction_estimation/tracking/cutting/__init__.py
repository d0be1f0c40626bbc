"""Long films, and where in them stones are thrown."""
