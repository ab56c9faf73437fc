"""What disturbances of a clip cost its volume: new views and mass beside those of the clean clip.

- ``smoke``: baked smoke with its pictures from four sides, and the same with a column that never leaves its pixels
- ``rows``: the clips, each with the clean one that it is compared with
- ``measure``: a clip as files, reconstructed by a state of the code, and scored

``python -m benchmarks.clean_clip OUT SCENES ...`` makes the table.
"""
