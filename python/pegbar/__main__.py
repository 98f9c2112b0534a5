"""`python -m pegbar` and the `pegbar` command: an interruption is one line even while the modules are being loaded."""

import sys


def run() -> int:
    """Run the command line and return its exit code."""
    try:
        from pegbar.cli.main import main

        return main()
    except KeyboardInterrupt:
        print("pegbar: interrupted; the finished frames are kept, run it again to go on", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(run())
