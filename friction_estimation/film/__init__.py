"""Films and pictures in and out: frames with their times, stabilised and evenly lit."""
