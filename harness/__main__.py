"""`python -m harness` is `wayproof`."""

import sys

from harness.cli.app import main

sys.exit(main())
