"""``python -m handclean``."""

import sys

from handclean.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
