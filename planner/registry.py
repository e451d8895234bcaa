"""The planners that come with wayproof, as scenarios name them.

Another distribution adds one by an entry point in the group `wayproof.planners` that names a `PlannerKind`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from planner.baselines import bendy_ruler, bug, dubins_tree, mppi, tangent_bug, vfh_plus
from planner.interface import Mission, Planner
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
        needs: an optional package without which `config.resolved` raises ValueError.
    """

    kind: str
    summary: str
    config: type[Any]
    make: Callable[[Any, Mission], Planner]
    bare: Callable[[Any, Mission], Planner] | None = None
    point: bool = False
    needs: str | None = None


BUILT_IN = (
    PlannerKind(
        kind="rolling_window",
        summary="improved BUG: rolling window, fan sectors, n-best multi-step search, route optimisation",
        config=rolling_window_config.RollingWindowConfig,
        make=rolling_window.RollingWindow,
        bare=partial(rolling_window.RollingWindow, shielded=False),
    ),
    PlannerKind(
        kind="improved_bug",
        summary="the paper's improved BUG, literally: it sees its window only, and can be caught",
        config=paper_config.ImprovedBugConfig,
        make=paper.ImprovedBug,
    ),
    PlannerKind(
        kind="bug1",
        summary="Bug1 (Lumelsky, Stepanov): round every obstacle, and on from its point nearest to the goal",
        config=bug.BugConfig,
        make=bug.Bug1,
        point=True,
    ),
    PlannerKind(
        kind="bug2",
        summary="Bug2 (Lumelsky, Stepanov): along the M-line, round obstacles until the line is met again",
        config=bug.BugConfig,
        make=bug.Bug2,
        point=True,
    ),
    PlannerKind(
        kind="tangent_bug",
        summary="TangentBug (Kamon, Rimon, Rivlin): by the edges in sight, along boundaries where caught",
        config=tangent_bug.TangentBugConfig,
        make=tangent_bug.TangentBug,
        point=True,
    ),
    PlannerKind(
        kind="vfh_plus",
        summary="VFH+ (Ulrich, Borenstein): polar histogram masked by the turn radius; local, can be caught",
        config=vfh_plus.VfhPlusConfig,
        make=vfh_plus.VfhPlus,
    ),
    PlannerKind(
        kind="bendy_ruler",
        summary="ArduPilot's BendyRuler, steered at the turn radius: probes bearings and a second line; local",
        config=bendy_ruler.BendyRulerConfig,
        make=bendy_ruler.BendyRuler,
    ),
    PlannerKind(
        kind="mppi",
        summary="MPPI (Williams et al.): weighted mean of sampled turns over a horizon; local, from a seed",
        config=mppi.MppiConfig,
        make=mppi.Mppi,
    ),
    PlannerKind(
        kind="dubins_tree",
        summary="RRT* of Dubins curves (OMPL), grown anew when the way is blocked; needs wayproof[ompl]",
        config=dubins_tree.DubinsTreeConfig,
        make=dubins_tree.DubinsTree,
        needs="ompl",
    ),
)
