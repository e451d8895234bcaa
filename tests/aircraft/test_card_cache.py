"""The cache of measurements."""

from pathlib import Path
from typing import Any

import pytest

from aircraft.card_cache import cache_folder
from aircraft.card_cache import cached as read_or_measured

WRONG = ('{"digest": 1}', '{"digest": "%s", "result": 3}', '{"digest": "%s", "result": {}}')


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "wayproof"


class Measurement:
    def __init__(self) -> None:
        self.times = 0

    def __call__(self) -> dict[str, Any]:
        self.times += 1
        return {"value": 0.1 + 0.2, "list": (1, 2)}


def cached(title: str, digest: str, measure: Measurement) -> dict[str, Any]:
    return read_or_measured(title, digest, measure, dict)


def test_is_measured_once_and_gives_the_same_either_way(folder: Path) -> None:
    measure = Measurement()
    first = cached("a", "d" * 64, measure)
    assert cached("a", "d" * 64, measure) == first == {"value": 0.1 + 0.2, "list": [1, 2]}
    assert measure.times == 1
    assert len(list(folder.iterdir())) == 1


@pytest.mark.parametrize("wreck", [None, "", "{", "[]", "\0", *WRONG])
def test_a_corrupt_or_edited_file_is_made_anew(folder: Path, wreck: str | None) -> None:
    measure = Measurement()
    first = cached("a", "d" * 64, measure)
    (file,) = folder.iterdir()
    edited = file.read_text("utf-8").replace("0.3000", "0.3001")
    file.write_text(edited if wreck is None else wreck.replace("%s", "d" * 64), "utf-8")
    assert cached("a", "d" * 64, measure) == first
    assert cached("a", "d" * 64, measure) == first
    assert measure.times == 2


def test_an_unwritable_folder_costs_only_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("", "utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    measure = Measurement()
    assert cached("a", "d" * 64, measure) == cached("a", "d" * 64, measure)
    assert measure.times == 2


@pytest.mark.parametrize("home", ["", "relative/path"])
def test_the_default_folder_is_in_the_home(home: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", home)
    assert cache_folder() == Path.home() / ".cache" / "wayproof"
