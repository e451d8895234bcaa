"""Checks compiled code on disk by a SHA-256: damaged code would end the process, or be flown with."""

from __future__ import annotations

import functools
import sys
import threading
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from typing import Any

SEAL_BYTES = 32  # length of the SHA-256 at the end of a file, which unpickling does not read
FRAME = b"\x80\x05\x95"
"""First bytes of an index: numba's version, a pickle of one frame, whose length follows in eight bytes."""
OWN_PACKAGES = ("aircraft", "harness", "planner")

_sealing = threading.Lock()


def seal() -> None:
    """Seals once, whichever of several threads comes first."""
    with _sealing:
        _seal()


@functools.cache
def _seal() -> None:
    """Has numba append a SHA-256 to each file of compiled code, and compile again where it does not match."""
    _put_off_registries()
    cache: Any = import_module("numba.core.caching").IndexDataCacheFile
    dump, load_index, load_data = cache._dump, cache._load_index, cache._load_data

    def sealed_dump(self: Any, content: Any) -> bytes:
        data: bytes = dump(self, content)
        return data + sha256(data).digest()

    def checked_index(self: Any) -> Any:
        path = Path(self._index_path)
        return load_index(self) if not path.exists() or _is_whole(path, is_index=True) else {}

    def checked_data(self: Any, name: str) -> Any:
        path = Path(self._data_path(name))
        if path.exists() and not _is_whole(path):
            raise OSError("is not as it was written")  # which numba takes for a missing file
        return load_data(self, name)

    cache._dump, cache._load_index, cache._load_data = sealed_dump, checked_index, checked_data


def _put_off_registries() -> None:
    """Has numba import what it compiles with, which takes a seventh of a second, only when something is compiled.

    Code of others may need that when it is loaded too. Inlined code of numba's own looks nothing up in its module.
    `scipy.linalg` is imported only when compiled code uses it. LLVM's calls are not timed, which takes as long as they.
    """
    cache: Any = import_module("numba.core.caching").Cache
    context: Any = import_module("numba.core.cpu").CPUContext
    environment: Any = import_module("numba.core.environment")
    load, register, rebuild = (
        cache.load_overload,
        context.load_additional_registries,
        environment._rebuild_env,
    )

    def load_overload(self: Any, signature: Any, target: Any) -> Any:
        if self._py_func.__module__.partition(".")[0] not in OWN_PACKAGES:
            return load(self, signature, target)
        import_module("numba.core.runtime").rtsys.initialize(target)
        return self._load_overload(signature, target)

    def load_additional_registries(self: Any) -> None:
        linalg: Any = import_module("numba.np.linalg")
        ensure, linalg.ensure_blas = linalg.ensure_blas, lambda: None
        arraymath: Any = import_module("numba.np.arraymath")  # calls it once
        linalg.ensure_blas = arraymath.ensure_blas = ensure
        register(self)

    @functools.wraps(rebuild)
    def rebuild_env(module: str, *rest: Any) -> Any:
        return rebuild("numba" if module.startswith("numba.") else module, *rest)

    cache.load_overload, context.load_additional_registries = load_overload, load_additional_registries
    environment._rebuild_env = rebuild_env
    import_module("llvmlite.binding").ffi.lib._lock._cblist.clear()


def _is_whole(path: Path, is_index: bool = False) -> bool:
    """Tells whether a file matches its SHA-256; if not, says so on standard error."""
    data = path.read_bytes()
    begin = 0
    if is_index:
        begin = len(FRAME) + 8 + int.from_bytes(data[3:11], "little") if data.startswith(FRAME) else len(data)
    if not (whole := sha256(data[begin:-SEAL_BYTES]).digest() == data[begin:][-SEAL_BYTES:]):
        _report_damaged(str(path.parent))
    return whole


@functools.cache
def _report_damaged(folder: str) -> None:
    """Says once for a folder that its compiled code is damaged."""
    text = f"compiled code in {folder} is damaged, or of an older version: compiled anew"
    sys.stderr.write(f"wayproof: {text}\n")
