"""Pictures for people: overlays, contact sheets, depth maps made visible."""
