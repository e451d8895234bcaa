"""Registers our environments with gymnasium when a program imports it; without gymnasium nothing happens."""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # as of `typing`, which takes longer to import than all of this
if TYPE_CHECKING:
    from importlib.machinery import ModuleSpec
    from typing import Any

GYMNASIUM = "gymnasium"  # once it is imported, the environments are registered
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
    """A finder that waits for the import of gymnasium, once; its base class takes long to import."""

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> ModuleSpec | None:
        """The module as all others find it, which registers our environments once it is there."""
        if fullname != GYMNASIUM:
            return None
        from importlib.util import find_spec

        sys.meta_path.remove(self)
        spec = find_spec(fullname)
        if spec is not None and spec.loader is not None:
            fill = spec.loader.exec_module

            def fill_and_register(module: Any) -> None:
                fill(module)
                _register()

            spec.loader.exec_module = fill_and_register  # type: ignore[method-assign]
        return spec
