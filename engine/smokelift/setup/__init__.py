"""From a description and its footage to a complete shot: geometry, light, medium, and no more model than needed."""
