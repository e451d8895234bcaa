"""`python -m harness` is `wayproof`."""

import sys

from harness.cli import main

sys.exit(main())
