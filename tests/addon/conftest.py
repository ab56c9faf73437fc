"""What lies in ``inside`` needs a process with Blender in it: test_inside_blender.py starts those."""

collect_ignore = ["inside"]
