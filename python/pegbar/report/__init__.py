"""Pictures for people: overlays, contact sheets, depth maps made visible, and the canvas they are drawn on."""
