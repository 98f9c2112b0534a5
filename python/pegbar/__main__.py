"""`python -m pegbar`: the command line."""

import sys

from pegbar.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
