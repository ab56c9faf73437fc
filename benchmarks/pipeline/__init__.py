"""A whole run from a clip to files on disk: seconds per frame and memory."""
