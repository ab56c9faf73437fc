"""Blender's data: what the engine's scene file is read from, and what a result is shown by."""
