"""What runs in Blender's own Python: it imports bpy, numpy and itself, and nothing of pegbar."""
