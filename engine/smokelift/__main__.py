"""``python -m smokelift``."""

import sys

from smokelift.app.cli import main

sys.exit(main())
