"""``python -m smokelift``."""

import sys

from smokelift.cli import main

sys.exit(main())
