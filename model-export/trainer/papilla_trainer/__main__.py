"""``python -m papilla_trainer``."""

import sys

from papilla_trainer.cli import main

if __name__ == "__main__":
    sys.exit(main())
