"""`python -m harness` is `wayproof`."""

import sys


def run() -> int:
    """Runs the command line and returns its exit status; an interrupt while its modules are imported ends it too."""
    try:
        from planner.compiled import own_this_process

        own_this_process()
        from harness.cli.app import main
    except KeyboardInterrupt:
        return 130
    return main()


if __name__ == "__main__":
    sys.exit(run())
