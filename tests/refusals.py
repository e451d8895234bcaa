"""Commands that are refused."""

import io
from contextlib import redirect_stderr, redirect_stdout

from harness.cli.app import main


def refused(*arguments: object) -> str:
    """What a command with these arguments says as it ends with status 2: nothing of it on standard output."""
    with redirect_stdout(io.StringIO()) as out, redirect_stderr(io.StringIO()) as err:
        status = main([str(each) for each in arguments])
    assert (status, out.getvalue()) == (2, ""), err.getvalue()
    return err.getvalue()
