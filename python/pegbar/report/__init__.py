<<<<<<< HEAD
"""Pictures for people: overlays, contact sheets, depth maps made visible."""
=======
"""Pictures and sheets that show people what came out."""
>>>>>>> sample
