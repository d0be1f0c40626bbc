"""The whole loop once, from film to a tested throw, on ice that it hides from itself."""
