"""From the drawing to three dimensions."""
