"""A whole run from a clip to files on disk, beside the paper's table 2."""
