"""Measured paths: kinematics, other programs' files, several cameras. A track knows no film."""
