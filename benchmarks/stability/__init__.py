"""A campaign against the command line: damaged files and hostile values, each in a process of its own.

- ``shot``: a tiny shot, whose files are damaged
- ``mutations``: how text, bytes, archives and tables are damaged
- ``cases``: the classes of cases; a case is a folder and the words of a command
- ``forked``: one case after the other, each in a fork of a process that has loaded the engine
- ``judge``: what a command may do, and what not

``python -m benchmarks.stability FOLDER --cases 100`` runs so many cases of every class and prints a table.
"""
