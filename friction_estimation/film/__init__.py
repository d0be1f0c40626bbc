"""Films in and out: frames with their times, held still and evenly lit. A film knows no camera."""
