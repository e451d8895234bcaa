"""Flies a path planner's waypoints with a JSBSim aircraft, closed loop, and says where they could be tracked.

    import wayproof

    run = wayproof.fly("aerosonde_forest")
    run.outcome, run.metrics.cross_track_m.p95, run.track.to_pandas()

The names are those of the package `harness`, which holds all of the simulation. Each is imported when it is first used.
"""

from __future__ import annotations

from wayproof.environments import register_environments

TYPE_CHECKING = False  # as of `typing`, which takes longer to import than all of this
if TYPE_CHECKING:
    from typing import Any

    from harness import *  # noqa: F403

register_environments()


def __getattr__(name: str) -> Any:
    """A name of `harness`, or the list of them."""
    from wayproof.rooms import own_packages

    if name.startswith("_") and name != "__all__":
        raise AttributeError(f"module 'wayproof' has no attribute {name!r}")
    harness = own_packages()
    if name in harness.__all__ or name == "__all__":
        globals()[name] = found = getattr(harness, name)
        return found
    raise AttributeError(f"module 'wayproof' has no attribute {name!r}")


def __dir__() -> list[str]:
    """The public names, for completion."""
    from wayproof.rooms import own_packages

    return sorted(own_packages().__all__)
