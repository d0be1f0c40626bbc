"""What discovery is given: the throws of a session, cleaned, and what is known beside them."""
