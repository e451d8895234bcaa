"""Planners of other distributions, by entry points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib.metadata import EntryPoint, EntryPoints

import pytest

from planner import registry
from planner.interface import Mission, Plan, PlanRequest, PlanStatus
from planner.registry import BUILT_IN, GROUP, PlannerKind, PluginError, planner_kinds


@dataclass(frozen=True)
class IdleConfig:
    def resolved(self, mission: Mission) -> IdleConfig:
        return self


class Idle:
    def plan(self, request: PlanRequest) -> Plan:
        return Plan(PlanStatus.NO_PATH, "idle")


def make_idle(config: IdleConfig, mission: Mission) -> Idle:
    return Idle()


IDLE = PlannerKind("idle", "does nothing", IdleConfig, make_idle)
IMPOSTOR = replace(IDLE, kind="rolling_window", summary="not the one that is built in")
NOT_A_KIND = make_idle


def install(monkeypatch: pytest.MonkeyPatch, *objects: str) -> None:
    """Makes module attributes of this file known as entry points of a distribution."""
    points = EntryPoints(EntryPoint(name.lower(), f"{__name__}:{name}", GROUP) for name in objects)

    def entry_points(*, group: str) -> EntryPoints:
        return points.select(group=group)

    monkeypatch.setattr(registry, "entry_points", entry_points)


@pytest.fixture(autouse=True)
def nothing_registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Other tests register planners in this process."""
    monkeypatch.setattr(registry, "_registered", {})


def test_the_planner_of_the_paper_is_built_in() -> None:
    assert "rolling_window" in planner_kinds()
    assert all(name == kind.kind for name, kind in planner_kinds().items())


def test_a_planner_of_another_distribution_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    assert "idle" not in planner_kinds()
    install(monkeypatch, "IDLE")
    kinds = planner_kinds()
    assert kinds["idle"] == IDLE
    assert list(kinds) == [*(kind.kind for kind in BUILT_IN), "idle"]


def test_built_in_names_win(monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, "IMPOSTOR")
    assert planner_kinds()["rolling_window"] == BUILT_IN[0]
    assert len(planner_kinds()) == len(BUILT_IN)


def test_what_is_no_planner_kind_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, "NOT_A_KIND")
    with pytest.raises(PluginError, match=r"'not_a_kind' \(.*:NOT_A_KIND\) of .* is no PlannerKind; mend or"):
        planner_kinds()


def test_what_cannot_be_loaded_is_told_with_its_distribution(monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, "ABSENT")
    with pytest.raises(
        PluginError, match=r":ABSENT\) of .* cannot be loaded: AttributeError: .*'ABSENT'; mend or"
    ):
        planner_kinds()
