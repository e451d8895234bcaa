"""The command `wayproof`. Each command is a few lines round functions; both are imported when they are needed.

Standard output carries results, standard error everything else. Exit status 130: interrupted by Ctrl-C, 143: by
SIGTERM; those of commands stand in their help.
"""

from __future__ import annotations

import errno
import os
import sys
import traceback
from collections.abc import Sequence
from importlib import import_module
from typing import Annotated, Final

import typer

from harness.cli.command_line import BAD_INPUT, FAILED, with_remedy
from harness.cli.options import Command, Group, flag
from harness.cli.terminal import output_kept_up, results_alone, results_over, say
from harness.files.errors import PlannerError, RunFolderError, WriteError, sentence
from harness.files.input_file import InputError
from harness.files.spawning import open_standard_files
from harness.flight.signals import signals_as_interrupt

INTERRUPTED_STATUS: Final = 130  # exit status after Ctrl-C
MEMORY_BYTES: Final = 1_200_000_000  # a flight needs this much address space; with half of it libraries abort

COMMANDS: Final = {
    "fly": "fly", "check": "check", "world": "world", "compare": "compare", "sweep": "sweep", "falsify": "falsify",
    "certify": "certify", "replay": "review", "validate": "inputs", "schema": "inputs", "view": "review",
    "report": "review", "export": "review", "bench": "bench", "envelope": "bench", "list": "inputs",
}  # fmt: skip
"""Module of each command."""


def _print_version(wanted: bool) -> None:
    if wanted:
        from harness.files.versions import versions

        say(f"wayproof {versions()['wayproof'] or '(run from its sources without being installed)'}")
        raise typer.Exit


def wayproof(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
    debug: Annotated[bool, flag("--debug", "Show the traceback of an error.")] = False,
) -> None:
    """Flies a path planner's waypoints with a JSBSim aircraft, in a closed loop, in an unknown world.

    For example: wayproof fly paper_circles
    """


def _program(words: Sequence[str]) -> typer.Typer:
    """Returns the program with the command that is called; where that is none, for help perhaps, with all."""
    program = typer.Typer(cls=Group, pretty_exceptions_enable=False)
    program.callback()(wayproof)
    for name in words[:1] if COMMANDS.keys() & words[:1] else COMMANDS:
        module = import_module(f"harness.cli.{COMMANDS[name]}")
        program.command(name, cls=Command)(getattr(module, "list_names" if name == "list" else name))
    return program


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line, by default that of the process, and returns its exit status."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    debug = "--debug" in given
    words = [each for each in given if each != "--debug"]
    if arguments is None:
        open_standard_files()
        results_alone()
        _warn_of_little_memory()
    with signals_as_interrupt() as signals:
        status = _run(words, debug)
    if arguments is None:
        results_over()
    return 128 + signals[0] if signals and status == INTERRUPTED_STATUS else status


def _warn_of_little_memory() -> None:
    """Warns of a memory limit under which libraries abort without a word."""
    import resource

    most, _ = resource.getrlimit(resource.RLIMIT_AS)
    if 0 <= most < MEMORY_BYTES:
        say(
            f"wayproof: a process may use {most / 1e6:.0f} MB here and a flight takes some {MEMORY_BYTES / 1e6:.0f}: "
            "lift the limit with `ulimit -v unlimited`",
            err=True,
        )


def _run(words: Sequence[str], debug: bool) -> int:
    try:
        with output_kept_up():
            program = _program(words)
            return int(program(list(words) or ["--help"], prog_name="wayproof", standalone_mode=False) or 0)
    except KeyboardInterrupt:
        return INTERRUPTED_STATUS
    except SystemExit:
        if "_WAYPROOF_COMPLETE" in os.environ:  # a shell asks for completions, which typer ends so
            raise
        say("wayproof: code that was loaded, a planner's perhaps, called sys.exit; nothing is done", err=True)
        return FAILED
    except Exception as error:
        if debug:
            say(traceback.format_exc().rstrip(), err=True)
        return _report(error)


def _report(error: Exception) -> int:
    message, status = f"wayproof: {error}", BAD_INPUT
    if isinstance(error, InputError):
        message = str(error)
    elif isinstance(error, typer.TyperException):
        # typer checks with pydantic
        text = " ".join(error.format_message().split()).replace("Value error, ", "")
        whose = getattr(getattr(error, "ctx", None), "command_path", "wayproof")
        if text.startswith("Missing") and getattr(getattr(error, "param", None), "name", "") == "aircraft":
            from aircraft.airframes import aircraft_names

            text = f"{text.rstrip('.')}: one of {', '.join(aircraft_names())}, or a folder"
        message = f"wayproof: {text} (see {whose} --help)"
    elif isinstance(error, WriteError):
        status = FAILED
    elif isinstance(error, OSError):
        message = f"wayproof: {with_remedy(error)}"
        status = FAILED if error.errno in (errno.ENOSPC, errno.EDQUOT) else BAD_INPUT
    elif not isinstance(error, RunFolderError):
        # Rooms that take long to import.
        from aircraft.model_files import AircraftError
        from harness.scenario.kinds import PluginError

        if not isinstance(error, AircraftError | PlannerError | PluginError):
            message = f"wayproof: internal error, {sentence(error)}; --debug shows where"
            status = FAILED
    say(message, err=True)
    return status
