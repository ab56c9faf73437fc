"""What a run leaves on disk: the OpenVDB sequence and pictures of it."""
