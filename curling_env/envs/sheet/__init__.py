"""`CurlingSheet-v0`: one throw a step at a target, on one sheet or on many side by side."""
