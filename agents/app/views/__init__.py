"""What screens show of sessions and throws, made ready for their templates."""
