"""The sub-commands for coaches: throws, athletes, stones, and why throws missed."""
