"""Files that are read and written: their limits and schemas, and results that appear together."""
