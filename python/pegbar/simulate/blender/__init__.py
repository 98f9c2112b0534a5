"""Blender as engine and renderer, in a process of its own: it is under the GPL, and a crash of it stays its own."""
