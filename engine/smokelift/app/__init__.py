"""The command line.

``cli`` has the parser, which knows every command, and the exit status. ``commands`` has what they take and do,
``options`` what several of them take, and ``progress`` what they say while they run.
"""
