"""Files to values and values to files. Nothing here imports a step."""
