"""Candidates for stones in a picture: moving objects, and detections of the network."""
