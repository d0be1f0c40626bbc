"""Sliding stones: one force law, the effects it sums, and the engines that use it."""
