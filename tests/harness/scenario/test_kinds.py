"""Planners and guidance laws of other distributions, by entry points."""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import EntryPoint, EntryPoints

import pytest

from harness.scenario import kinds
from harness.scenario.kinds import GUIDANCE, PLANNER, LoopPart, PluginError

MINE = replace(PLANNER.built_in[1], kind="mine")
MY_LAW = replace(GUIDANCE.built_in[1], kind="mine")
IMPOSTOR = replace(MINE, kind="rolling_window", summary="not the one that is built in")
LAW_IMPOSTOR = replace(MY_LAW, kind="preview", summary="not the one that is built in")

PARTS = pytest.mark.parametrize(
    ("part", "mine", "impostor"), [(PLANNER, "MINE", "IMPOSTOR"), (GUIDANCE, "MY_LAW", "LAW_IMPOSTOR")]
)


@pytest.fixture(autouse=True)
def nothing_registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Other tests register kinds in this process."""
    for part in (PLANNER, GUIDANCE):
        monkeypatch.setattr(part, "registered", {})


def install(monkeypatch: pytest.MonkeyPatch, part: LoopPart, name: str) -> None:
    """Makes an attribute of this file known as an entry point of a distribution."""
    points = EntryPoints([EntryPoint(name.lower(), f"{__name__}:{name}", part.group)])
    monkeypatch.setattr(kinds, "entry_points", lambda group: points.select(group=group))


@PARTS
def test_a_kind_of_another_distribution_is_found_and_a_built_in_name_wins(
    part: LoopPart, mine: str, impostor: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    built_in = [kind.kind for kind in part.built_in]
    assert list(part.known()) == built_in
    install(monkeypatch, part, mine)
    assert list(part.known()) == [*built_in, "mine"]
    assert part.known()["mine"] is globals()[mine]
    with pytest.raises(ValueError, match=f"there is a {part.noun} called mine already"):
        part.register(globals()[mine])
    install(monkeypatch, part, impostor)
    assert list(part.known().values()) == list(part.built_in)


@PARTS
@pytest.mark.parametrize(
    ("named", "told"),
    [("install", "is no {}; mend or"), ("ABSENT", "cannot be loaded: AttributeError: .*'ABSENT'; mend or")],
)
def test_what_is_no_kind_or_cannot_be_loaded_is_refused(
    part: LoopPart, mine: str, impostor: str, named: str, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(monkeypatch, part, named)
    expected = rf"the {part.noun} of entry point .*:{named}\) of .* {told.format(part.kind.__name__)}"
    with pytest.raises(PluginError, match=expected):
        part.known()
