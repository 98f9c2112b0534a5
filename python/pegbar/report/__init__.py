"""Pictures and sheets that show people what came out."""
