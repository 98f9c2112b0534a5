"""Drawings to 3D: limb alignment and marker reconstruction (2009 paper, sections 3.4-3.5)."""
