"""The command `wayproof`, which `python -m wayproof` is too."""

import sys


def main() -> int:
    """Runs the command line and returns its exit status."""
    from wayproof.rooms import own_packages

    try:
        own_packages()
    except ImportError as error:
        sys.stderr.write(f"wayproof: {error}\n")
        return 2
    from harness.cli.app import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
