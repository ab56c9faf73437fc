"""Pictures of the add-on for the manual, and what Blender makes of results. Needs bpy, and the tests' example shot."""
