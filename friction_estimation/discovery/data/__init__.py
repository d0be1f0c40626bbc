"""Input of discovery: the cleaned throws of a session, and other knowledge about them."""
