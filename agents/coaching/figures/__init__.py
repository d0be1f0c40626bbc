"""The pictures of what coaching tells."""
