"""What an overlay shows on top of a film."""
