"""From drawn joints and a clip to cameras: which frames belong together, and from where the artist saw the motion."""
