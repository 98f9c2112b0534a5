"""Runs a script in Blender and says truthfully whether it came to its end.

Started by `pegbar.simulate.blender.process`. Arguments after ``--``: the script, then the script's own, which it finds
in ``sys.argv[1:]``. A script reports progress by printing ``pegbar:progress:DONE:TOTAL``.
"""

from __future__ import annotations

import os
import runpy
import sys
import threading
import traceback

DONE = "pegbar:done"


def main() -> None:
    """Run the script; the process ends here, since Blender may crash while it takes itself apart."""
    script, *arguments = sys.argv[sys.argv.index("--") + 1 :]
    threading.Thread(target=end_with_parent, daemon=True).start()
    sys.argv = [script, *arguments]
    sys.path.insert(0, os.path.dirname(script))
    code = 1
    try:
        runpy.run_path(script, run_name="__main__")
        code = 0
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else int(error.code is not None)
        if code and not isinstance(error.code, int):
            print(error.code, flush=True)
    except BaseException:
        traceback.print_exc()
    if not code:
        print(DONE, flush=True)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def end_with_parent() -> None:
    """End this process when the one that started it is gone: its end of our standard input closes."""
    while os.read(0, 4096):
        pass
    os._exit(1)


if __name__ == "__main__":
    main()
