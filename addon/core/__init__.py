"""What knows nothing of Blender: the files of a run, the engine's process and its messages, what is repeated of it."""
