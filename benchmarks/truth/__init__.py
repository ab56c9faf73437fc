"""Scenes with known volumes and velocities: baked by Mantaflow, pictured by Mitsuba. README.md says how."""
