"""Set-up of a shot from a description and its footage: geometry, light, medium, and no more model than needed."""
