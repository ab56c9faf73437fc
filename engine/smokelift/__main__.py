"""``python -m smokelift``."""

import sys

from smokelift_command import main

sys.exit(main())
