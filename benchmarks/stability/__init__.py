"""A campaign against the command line: damaged files, hostile values and failing systems, each in its own process.

- ``shot``: a tiny shot, whose files are damaged
- ``mutations``: how text, bytes, archives and tables are damaged
- ``cases``: the classes of cases
- ``environments``: what of the system fails: disk, folder, memory, threads, files, network, a signal
- ``recovery``: a run whose system fails, and the run that goes on from it
- ``forked``: one case after the other, each in a fork of a process that has loaded the engine, and what it may do

``python -m benchmarks.stability FOLDER --cases 100`` runs so many cases of every class and prints a table.
"""

import os

# as the command does, before NumPy is loaded: OpenBLAS hangs in a fork that may start no threads
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
