"""Sub-commands for coaches: throws, athletes, stones, and causes of misses."""
