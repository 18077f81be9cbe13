"""``python -m levelhead`` is the command ``levelhead``."""

import sys

from levelhead.cli import main

sys.exit(main())
