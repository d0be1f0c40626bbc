"""JSON Schemas of the project's JSON files, in docs/schemas; `make schemas` writes them anew.

What the program reads is described by the forms that its readers check with; what it only writes,
by those in `written.py`.
"""
