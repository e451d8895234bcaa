"""The command `wayproof`, which `python -m wayproof` is too."""

import sys


def main() -> int:
    """Runs the command line and returns its exit status."""
    try:
        from wayproof.rooms import own_packages

        own_packages()
        from harness.__main__ import run
    except ImportError as error:
        sys.stderr.write(f"wayproof: {error}\n")
        return 2
    except KeyboardInterrupt:
        return 130
    return run()


if __name__ == "__main__":
    sys.exit(main())
