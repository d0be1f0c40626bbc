"""Long work in processes beside the server: tracking, estimating, recording.

What is to be done and how far it is stands in the database. So a server that was killed finds it
there, and goes on.
"""
