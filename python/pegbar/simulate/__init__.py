"""The 3D side of a shot: what is simulated, and the passes that are rendered of it."""
