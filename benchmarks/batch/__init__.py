"""A batch on a cluster whose parts are killed while it runs."""
