"""A whole run from a clip to files on disk: seconds a frame and memory."""
