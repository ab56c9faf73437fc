"""The example clip: baked by Mantaflow, pictured by Mitsuba. README.md says how."""
