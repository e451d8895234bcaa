"""Geometry compiled to machine code (numba): the loops over edge points that most of a planner's time goes to.

Functions that most flights call are compiled together, for the types of arguments that they name, by `compile_all`
before a flight; those that are `rare`, when one is first called. What was compiled is kept on disk by file: a compiled
function calls none of another file, and numbers that it takes from one never change. To import them takes no time. Fast
mathematics is off: the same numbers give the same results.
"""

from __future__ import annotations

import atexit
import functools
import gc
import importlib
import os
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import Any, Generic, ParamSpec, TypeVar

from planner.kernel_cache import seal

FLOAT, COUNT, BOOL = "float64", "intp", "boolean"
FLOATS = "Array(float64, 1, 'C', readonly=True)"  # (n,) numbers
ROWS = "Array(float64, 2, 'C', readonly=True)"  # (n, k): points, or the segments of a path
PLACES = "Array(complex128, 1, 'C', readonly=True)"  # (n,) points, east + i north
POINT = "UniTuple(float64, 2)"  # east and north of a point
GRID = "Array(boolean, 2, 'C', readonly=True)"  # mask of cells
INTS = "Array(intp, 1, 'C', readonly=True)"  # (n,) counts, indices or labels
BOOLS_OUT, COUNTS_OUT, FLOATS_OUT, PLACES_OUT = "boolean[::1]", "intp[::1]", "float64[::1]", "complex128[::1]"
"""Arrays that a function changes."""

STARTING_OBJECTS = 300_000
"""Garbage is looked for once this many more objects are there than before, until all is compiled: a start has fewer."""
STARTS_BYTES = 2500  # starting a second process takes about as long as compiling this many bytes of byte code

P = ParamSpec("P")
R = TypeVar("R")


class Compiled(Generic[P, R]):
    """A function that is compiled before it is first called.

    Args:
        function: the function.
        arguments: their types. Others are refused: nothing is ever compiled anew.
        rare: few flights call it.
        inner: compiled functions of its module alone call it. It is compiled only with the first of them that is not on
            disk; what Python needs to call it is not compiled.
    """

    def __init__(
        self, function: Callable[P, R], arguments: tuple[str, ...], rare: bool = False, inner: bool = False
    ) -> None:
        self._function, self._arguments, self.rare, self._inner = function, arguments, rare, inner
        self._code: Callable[..., R] = self._compile_first
        self.anew, self.stored = False, True
        """It was compiled by this process, not loaded; what was compiled is on disk."""
        self.size = len(function.__code__.co_code)
        """Length of its byte code, bytes: compiling takes about as long."""
        functools.update_wrapper(self, function)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Calls what was compiled; arguments are given by position."""
        return self._code(*args)

    def _compile_first(self, *args: Any) -> R:
        """The first call: compiles the function with all others that wait, then calls it."""
        compile_all()
        if self.rare:
            with _compiling:
                _compile(_functions(self.__module__))
        assert self._code != self._compile_first
        return self._code(*args)

    @property
    def _numba_type_(self) -> Any:
        """Its type, which numba asks for while it compiles a function that calls this one."""
        if self._code == self._compile_first:
            self.compile()
        return self._code._numba_type_  # type: ignore[attr-defined]

    def compile(self) -> None:
        """Compiles it, or loads what was compiled before. Division by zero gives what it gives in numpy."""
        import numba  # half a second

        seal()
        signature = f"({', '.join(self._arguments)},)"
        wrappers: Any = {"no_cfunc_wrapper": True, "no_cpython_wrapper": self._inner}
        try:
            code: Any = numba.njit(signature, cache=True, error_model="numpy", **wrappers)(self._function)
        except (OSError, RuntimeError) as error:
            if isinstance(error, RuntimeError) and "cannot cache" not in str(error):
                raise
            # There is no place to keep it, or no room there.
            self.stored = False
            code = numba.njit(signature, error_model="numpy", **wrappers)(self._function)
        self.anew = not code.stats.cache_hits
        self._code = code
        # Functions of the same file that call it find what is compiled.
        self._function.__globals__[self._function.__name__] = code


_waiting: list[Compiled[..., Any]] = []
_inner_sizes: Counter[str] = Counter()  # length of the inner functions of each module, bytes
_compiling = threading.RLock()


def compiled(*arguments: str, rare: bool = False, inner: bool = False) -> Callable[[Callable[P, R]], Compiled[P, R]]:
    """Decorates a function that is compiled later, for arguments of these types."""

    def compile_later(function: Callable[P, R]) -> Compiled[P, R]:
        made = Compiled(function, arguments, rare, inner)
        if inner:
            _inner_sizes[made.__module__] += made.size
        else:
            _waiting.append(made)
        return made

    return compile_later


def _functions(module: str = "") -> list[Compiled[..., Any]]:
    """The functions imported so far that are not compiled yet: all of a module, or those that are not rare."""
    return [each for each in _waiting if (each.__module__ == module if module else not each.rare)]


def compile_all(rare: bool = False) -> None:
    """Compiles all functions imported so far but the rare ones: some seconds the first time, then tenths of one.

    One line on standard error announces the first time, where that is a terminal. Where there are two processors, a
    second process compiles half of them meanwhile. With `rare` those are compiled as well.
    """
    global _second
    with _compiling:
        waiting = _functions() + (list(_waiting) if rare else [])
        if not waiting:
            return
        begin_compiling()
        elsewhere = _second[0] if _second else frozenset()
        _compile([each for each in _functions() if each.__module__ not in elsewhere])
        if _second:
            _second[1].wait()
            _second = None
        _compile(_functions())
        _compile(list(_waiting) if rare else ())
        _let_stay(any(each.anew for each in waiting))


def _let_stay(anew: bool) -> None:
    """Counts the compiler, which stays for good, among the old objects; collects what compiling `anew` left behind.

    Garbage is then looked for there only when as many new objects have come as would be a quarter of it: that would
    hold a flight up for a tenth of a second.
    """
    if anew or not _process_is_ours:
        gc.collect()
    if _process_is_ours:
        gc.freeze()
        gc.set_threshold(*_usual_threshold)


def compile_modules(names: Sequence[str], parent: int) -> None:
    """Compiles the functions of some modules, so that they are on disk, as long as the parent process lives."""
    for name in names:
        importlib.import_module(name)
    with _compiling:
        _compile(each for each in _functions() if each.__module__ in names and os.getppid() == parent)


def _start_process(names: frozenset[str]) -> subprocess.Popen[bytes]:
    """Starts a process that puts the functions of some modules on disk, unless it fails; it does not outlive this."""
    code = f"import sys; sys.path[:] = {sys.path!r}; from planner.compiled import compile_modules; "
    command = [sys.executable, "-c", code + f"compile_modules({sorted(names)!r}, {os.getpid()})"]
    nobody = subprocess.DEVNULL
    process = subprocess.Popen(command, stdin=nobody, stdout=nobody, stderr=nobody)
    atexit.register(process.kill)
    return process


# Modules, and the process that compiles them.
_second: tuple[frozenset[str], subprocess.Popen[bytes]] | None = None


def begin_compiling(busy_bytes: int = 0) -> None:
    """Has a second process compile some of the functions imported so far, until `compile_all` needs them.

    One is compiled here. Where that was on disk, or where there is one processor, there is no second process. This one
    is busy with something else for as long as compiling `busy_bytes` of byte code takes.
    """
    global _second
    with _compiling:
        if _second or not _functions():
            return
        # The shortest tells soonest whether they are on disk; with it come the inner ones of its module.
        first = min(_functions(), key=lambda each: each.size + _inner_sizes[each.__module__])
        _compile([first])
        if not first.anew:
            return
        if sys.stderr is not None and sys.stderr.isatty():
            sys.stderr.write("wayproof: compiling for this machine, once; this takes some seconds\n")
        names = _share(_functions(), busy_bytes) if first.stored and os.cpu_count() != 1 else frozenset()
        with suppress(OSError):  # All are then compiled here.
            _second = (names, _start_process(names)) if names else None


def _compile(functions: Iterable[Compiled[..., Any]]) -> None:
    collects = gc.isenabled()
    gc.disable()  # Else a fifth of the time is spent looking for garbage among what the compiler keeps.
    try:
        for each in functions:
            each.compile()
            _waiting.remove(each)
    finally:
        if collects:
            gc.enable()


def _share(functions: Sequence[Compiled[..., Any]], busy_bytes: int) -> frozenset[str]:
    """Chooses the modules that a second process compiles, so that both processes end at about the same time."""
    # Functions of one module call each other, so that a module stays whole.
    sizes: Counter[str] = Counter()
    for each in functions:
        sizes[each.__module__] += each.size
    sizes.update({name: _inner_sizes[name] for name in sizes})
    here, there = busy_bytes, STARTS_BYTES
    names = set()
    for name, size in sizes.most_common():
        if here <= there:
            here += size
        else:
            there += size
            names.add(name)
    return frozenset(names)


_process_is_ours, _usual_threshold = False, gc.get_threshold()


def own_this_process() -> None:
    """Says that nobody else's objects live in this process: until all is compiled garbage is hardly looked for."""
    global _process_is_ours
    _process_is_ours = True
    gc.set_threshold(STARTING_OBJECTS)
