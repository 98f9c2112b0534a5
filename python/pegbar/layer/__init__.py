"""Limb masks, depth, mattes and the depth composite of one frame (2010 paper, section 3.3)."""
