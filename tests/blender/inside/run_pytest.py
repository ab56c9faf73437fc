"""Run pytest inside Blender: ``blender -b --python run_pytest.py -- ARGUMENTS``. It has no other way in."""

import os
import sys

import pytest

status = pytest.main(sys.argv[sys.argv.index("--") + 1 :])
sys.stdout.flush()
os._exit(status)  # Blender would end with 0
