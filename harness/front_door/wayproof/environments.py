"""Registers our environments with gymnasium when a program imports it; without gymnasium nothing happens."""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # as of `typing`, which takes longer to import than all of this
if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.abc import Loader
    from importlib.machinery import ModuleSpec
    from types import ModuleType

GYMNASIUM = "gymnasium"
ENVIRONMENTS = {"wayproof/Waypoints-v0": "harness.learning.environments:WaypointsEnv"}


def register_environments() -> None:
    """Lets `gymnasium.make` know the environments: at once, or as soon as gymnasium is imported."""
    if sys.modules.get(GYMNASIUM) is not None:
        _register()
    elif not any(isinstance(each, _Watcher) for each in sys.meta_path):
        sys.meta_path.insert(0, _Watcher())


def _register() -> None:
    from gymnasium import register, registry

    for name, made_by in ENVIRONMENTS.items():
        if name not in registry:
            register(name, made_by)


class _Watcher:
    """Waits for the import of gymnasium, once. A finder, without its base class, which takes long to import."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """The module as all others find it, with a loader that registers afterwards."""
        if fullname != GYMNASIUM:
            return None
        from importlib.util import find_spec

        sys.meta_path.remove(self)
        spec = find_spec(fullname)
        if spec is not None and spec.loader is not None:
            spec.loader = _Registers(spec.loader)  # type: ignore[assignment]
        return spec


class _Registers:
    """A loader, likewise, that registers once its module is there."""

    def __init__(self, loader: Loader) -> None:
        self._loader = loader

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        """As the loader does."""
        return self._loader.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        """As the loader does, and then registers."""
        self._loader.exec_module(module)
        if module.__spec__ is not None:
            module.__spec__.loader = module.__loader__ = self._loader
        _register()
