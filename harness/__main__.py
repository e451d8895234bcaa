"""`python -m harness` is `wayproof`."""

import os
import sys


def run() -> int:
    """Runs the command line and returns its exit status; an interrupt while its modules are imported ends it too."""
    # No matrix here is large. Else each further thread of numpy's linear algebra runs idle for 25 ms when it starts.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        from planner.compiled import own_this_process

        own_this_process()
        from harness.cli.app import main
    except KeyboardInterrupt:
        return 130
    return main()


if __name__ == "__main__":
    sys.exit(run())
