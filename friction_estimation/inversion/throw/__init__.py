"""One throw: the path it took, its motion along it under the force law, and both linearised."""
