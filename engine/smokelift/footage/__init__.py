"""Pictures in linear light, and the smoke in them apart from its background."""
