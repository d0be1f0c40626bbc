"""Input of discovery: the cleaned throws of a session, and prior knowledge about them."""
