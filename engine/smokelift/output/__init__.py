"""What a run leaves on disk: the OpenVDB sequence and pictures of it.

``writer`` writes a sequence: ``vdb`` files, `sequence.json` and a lock, by ``index``, and in an ``archive`` what an
interrupted run goes on from. ``sequence`` reads one, and renders what cameras see of it. ``export`` makes files for
other programs of it; ``preview`` makes sheets of pictures and videos, which ``images`` writes.
"""
