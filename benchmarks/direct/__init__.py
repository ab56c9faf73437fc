"""Continued smoke beside what really came: ``python -m benchmarks.direct.continuation SCENES --runs OUT``."""
