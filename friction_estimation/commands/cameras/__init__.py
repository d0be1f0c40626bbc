"""Commands that mark, solve and join cameras."""
