"""Finding the clip's time, view and camera for a drawing: descriptors, time warp, search, pose, registration."""
