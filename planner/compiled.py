"""Geometry compiled to machine code (numba): the loops over edge points that most of a planner's time goes to.

All functions are compiled together, for the types of arguments that they name, by `compile_all` before a flight: what
was compiled is kept on disk, by file, so that a compiled function calls none of another file (but `fused`, which is an
instruction), and numbers that it takes from one never change. To import them takes no time. Fast mathematics is left
off: the same numbers give the same results.
"""

from __future__ import annotations

import functools
import gc
import importlib
import os
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from typing import Any, Generic, ParamSpec, TypeVar

FLOAT, COUNT, BOOL = "float64", "intp", "boolean"
FLOATS = "Array(float64, 1, 'C', readonly=True)"
ROWS = "Array(float64, 2, 'C', readonly=True)"
"""(n, k): points, or the segments of a path."""
PLACES = "Array(complex128, 1, 'C', readonly=True)"
"""(n,) points, east + i north."""
GRID = "Array(boolean, 2, 'C', readonly=True)"
COUNTS = "Array(intp, 1, 'C', readonly=True)"
BOOLS_OUT, COUNTS_OUT, FLOATS_OUT, PLACES_OUT = "boolean[::1]", "intp[::1]", "float64[::1]", "complex128[::1]"
"""Arrays that a function changes."""

STARTS_BYTES = 2500
"""A second process starts in about the time in which so much byte code is compiled."""

P = ParamSpec("P")
R = TypeVar("R")


def fused(a: float, b: float, c: float) -> float:
    """Product of two numbers and a third added, rounded once."""
    return float(Fraction(a) * Fraction(b) + Fraction(c))


class Compiled(Generic[P, R]):
    """A function that is compiled before it is first called.

    Args:
        function: the function.
        arguments: their types. Others are refused: nothing is ever compiled anew.
        unchecked: others are not refused, and may overwrite anything: to compare types takes as long as a short
            function does. Not for one that other compiled ones call.
    """

    def __init__(self, function: Callable[P, R], arguments: tuple[str, ...], unchecked: bool = False) -> None:
        self._function, self._arguments, self._unchecked = function, arguments, unchecked
        self._code: Callable[..., R] = self._compile_first
        self.anew = False
        """It was compiled by this process, not loaded."""
        self.kept = True
        """What was compiled is on disk."""
        self.size = len(function.__code__.co_code)
        """Length of its byte code, bytes: compiling takes about as long."""
        functools.update_wrapper(self, function)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Calls what was compiled; arguments are told by their place."""
        return self._code(*args)

    def _compile_first(self, *args: Any) -> R:
        compile_all()
        assert self._code != self._compile_first
        return self._code(*args)

    def compile(self) -> None:
        """Compiles it, or loads what was compiled before. Division by zero gives what it gives in numpy."""
        import numba  # half a second

        _learn_to_fuse()
        signature = f"({', '.join(self._arguments)},)"
        try:
            code: Any = numba.njit(signature, cache=True, error_model="numpy")(self._function)
        except (OSError, RuntimeError) as error:
            if isinstance(error, RuntimeError) and "cannot cache" not in str(error):
                raise
            # There is no place to keep it, or no room there.
            self.kept = False
            code = numba.njit(signature, error_model="numpy")(self._function)
        self.anew = not code.stats.cache_hits
        if self._unchecked:
            (only,) = code.overloads.values()
            code = only.entry_point
        self._code = code
        # Functions of the same file that call it find what is compiled.
        self._function.__globals__[self._function.__name__] = code


_waiting: list[Compiled[..., Any]] = []
_compiling = threading.RLock()


def compiled(*arguments: str, unchecked: bool = False) -> Callable[[Callable[P, R]], Compiled[P, R]]:
    """Has a function compiled for arguments of these types."""

    def compile_later(function: Callable[P, R]) -> Compiled[P, R]:
        made = Compiled(function, arguments, unchecked)
        _waiting.append(made)
        return made

    return compile_later


@functools.cache
def _learn_to_fuse() -> None:
    """Has `fused` be one instruction of the processor, where it has that."""
    from numba import types
    from numba.extending import intrinsic, overload

    @intrinsic
    def fma(_typing: Any, a: Any, b: Any, c: Any) -> Any:
        def code(_context: Any, builder: Any, _signature: Any, numbers: Any) -> Any:
            return builder.fma(*numbers)

        return types.float64(a, b, c), code

    instruction: Any = fma
    overload(fused)(lambda a, b, c: lambda a, b, c: instruction(a, b, c))


def compile_all() -> None:
    """Compiles all functions imported so far that are not yet: some seconds the first time, then some tenths.

    The first time is told by one line on standard error, where that is a terminal. Where there are two processors, a
    second process compiles half of them meanwhile.
    """
    with _compiling:
        if not _waiting:
            return
        # The compiler makes many objects that stay: to look through them for garbage takes a tenth of its time.
        looked = gc.isenabled()
        gc.disable()
        try:
            _compile_waiting()
        finally:
            if looked:
                gc.enable()
        # The compiler stays for good. Once it is counted among the old objects, garbage is looked for there only when
        # as many new ones have come as would be a quarter of it: that would hold a flight up for a tenth of a second.
        gc.collect()
        if _process_is_ours:
            gc.freeze()


def _compile_waiting() -> None:
    while _waiting:
        # The first function of a module calls no other one. The shortest tells soonest whether they are on disk.
        first = min(
            {each.__module__: each for each in reversed(_waiting)}.values(), key=lambda each: each.size
        )
        _compile([first])
        if first.anew:
            _tell("wayproof: compiling for this machine, once; this takes some seconds")
            elsewhere = _half(_waiting) if first.kept and os.cpu_count() != 1 else set()
            with _compiled_elsewhere(elsewhere):
                _compile([each for each in _waiting if each.__module__ not in elsewhere])
            _compile(list(_waiting))


def compile_modules(names: Sequence[str]) -> None:
    """Compiles the functions of some modules, so that they are on disk."""
    for name in names:
        importlib.import_module(name)
    gc.disable()  # This process does nothing else.
    with _compiling:
        _compile([each for each in _waiting if each.__module__ in names])


def _compile(functions: Sequence[Compiled[..., Any]]) -> None:
    for each in functions:
        each.compile()
        _waiting.remove(each)


def _half(functions: Sequence[Compiled[..., Any]]) -> set[str]:
    # Functions of one module call each other, so that a module stays whole.
    sizes: Counter[str] = Counter()
    for each in functions:
        sizes[each.__module__] += each.size
    here, there = 0, STARTS_BYTES
    names = set()
    for name, size in sizes.most_common():
        if here <= there:
            here += size
        else:
            there += size
            names.add(name)
    return names


@contextmanager
def _compiled_elsewhere(names: set[str]) -> Iterator[None]:
    """Has another process compile some modules; at the end they are on disk, unless that process failed."""
    code = f"import sys; sys.path[:] = {sys.path!r}; from planner.compiled import compile_modules; "
    command = [sys.executable, "-c", code + f"compile_modules({sorted(names)!r})"]
    nobody = subprocess.DEVNULL
    try:
        process = subprocess.Popen(command, stdin=nobody, stdout=nobody, stderr=nobody) if names else None
    except OSError:
        process = None  # All are then compiled here.
    try:
        yield
        if process is not None:
            process.wait()
    finally:
        if process is not None:
            process.kill()
            process.wait()


_process_is_ours = False


def own_this_process() -> None:
    """Says that nobody else's objects live in this process: what is there after compiling is never garbage."""
    global _process_is_ours
    _process_is_ours = True


def _tell(line: str) -> None:
    """Tells a person who waits; a script is not told."""
    if sys.stderr is not None and sys.stderr.isatty():
        sys.stderr.write(f"{line}\n")
