"""Reading and writing files: limits, schemas, and results that appear together."""
