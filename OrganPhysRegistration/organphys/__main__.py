"""``python -m organphys`` is the command ``organphys``."""

import sys

from .pipeline.command_line import main

if __name__ == "__main__":
    sys.exit(main())
