"""`python -m harness` is `wayproof`."""

import atexit
import os
import sys
from contextlib import suppress

INTERRUPTED = 128  # exit statuses above this are those after a signal


def run() -> int:
    """Runs the command line and returns its exit status; after an interrupt it ends the process itself."""
    # No matrix here is large. Else each further thread of numpy's linear algebra runs idle for 25 ms when it starts.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "1")  # else pydantic looks through all distributions
    try:
        from planner.compiled import own_this_process

        own_this_process()
        from harness.cli.app import main

        status = main()
    except KeyboardInterrupt:  # while modules are imported
        status = 130
    if status > INTERRUPTED:
        _leave(status)
    return status


def _leave(status: int) -> None:
    """Ends the process with a status.

    Python itself would end it by SIGINT, and lose the status, if an interrupt was raised in a text that `exec` runs, as
    dataclasses do, though it was caught. Libraries whose start was interrupted may crash when the interpreter ends.
    """
    atexit._run_exitfuncs()
    with suppress(AttributeError, OSError, ValueError):  # closed by whoever started us
        sys.stderr.flush()
    os._exit(status)


if __name__ == "__main__":
    sys.exit(run())
