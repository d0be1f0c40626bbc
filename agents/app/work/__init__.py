"""Long work in processes beside the server: tracking, estimating, recording.

Waiting work and its progress are kept in the database, so that a server that was killed continues
after a restart.
"""
