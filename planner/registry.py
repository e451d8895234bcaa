"""The planners that come with wayproof, as scenarios name them.

Another distribution adds one by an entry point in the group `wayproof.planners` that names a `PlannerKind`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from planner.baselines import bendy_ruler, bug, dubins_tree, mppi, tangent_bug, vfh_plus
from planner.baselines.walk import Walker
from planner.interface import Mission, Planner
from planner.keys import MarginConfig
from planner.paper import config as paper_config
from planner.paper import rolling as paper
from planner.rolling_window import config as rolling_window_config
from planner.rolling_window import planner as rolling_window


@dataclass(frozen=True)
class PlannerKind:
    """A planner that scenarios may name.

    Attributes:
        kind: the name, as in `planner.kind` of a scenario.
        summary: one line for `wayproof list planners`.
        config: frozen dataclass of the planner's own keys. Each field has a default and the metadata `doc` (a
            sentence), `unit`, and `minimum` / `maximum` or `above` where there is such a bound. A default of
            None is derived: `config.resolved(mission)` returns the config with no None left and raises
            ValueError, with a sentence, where keys contradict each other.
        make: the planner for one flight, from a resolved config.
        bare: the same without the shield, where `make` has one built in.
        point: its paths are those of a point that can turn on the spot: their direction jumps at joints.
    """

    kind: str
    summary: str
    config: type[Any]
    make: Callable[[Any, Mission], Planner]
    bare: Callable[[Any, Mission], Planner] | None = None
    point: bool = False


BUILT_IN = (
    PlannerKind(
        "rolling_window",
        "improved BUG: rolling window, fan sectors, n-best multi-step search, route optimisation",
        rolling_window_config.RollingWindowConfig,
        rolling_window.RollingWindow,
        bare=partial(rolling_window.RollingWindow, shielded=False),
    ),
    *(
        PlannerKind(kind, summary, config, make, point=issubclass(make, Walker))
        for kind, config, make, summary in (
            ("improved_bug", paper_config.ImprovedBugConfig, paper.ImprovedBug,
             "the paper's improved BUG, literally: it sees its window only, and can be caught"),
            ("bug1", MarginConfig, bug.Bug1,
             "Bug1 (Lumelsky, Stepanov): round every obstacle, and on from its point nearest to the goal"),
            ("bug2", MarginConfig, bug.Bug2,
             "Bug2 (Lumelsky, Stepanov): along the M-line, round obstacles until the line is met again"),
            ("tangent_bug", MarginConfig, tangent_bug.TangentBug,
             "TangentBug (Kamon, Rimon, Rivlin): by the edges in sight, along boundaries where caught"),
            ("vfh_plus", MarginConfig, vfh_plus.VfhPlus,
             "VFH+ (Ulrich, Borenstein): polar histogram masked by the turn radius; local, can be caught"),
            ("bendy_ruler", MarginConfig, bendy_ruler.BendyRuler,
             "ArduPilot's BendyRuler, steered at the turn radius: probes bearings and a second line; local"),
            ("mppi", mppi.MppiConfig, mppi.Mppi,
             "MPPI (Williams et al.): weighted mean of sampled turns over a horizon; local, from a seed"),
            ("dubins_tree", dubins_tree.DubinsTreeConfig, dubins_tree.DubinsTree,
             "RRT of Dubins curves, grown anew when the way is blocked; what is unseen counts as free"),
        )
    ),
)  # fmt: skip
