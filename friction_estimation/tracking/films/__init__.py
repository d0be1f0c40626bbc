"""Films tracked one after the other: one camera for a scene, and work taken up again."""
