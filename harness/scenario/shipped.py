"""The scenarios that come with the package, by name."""

from __future__ import annotations

from pathlib import Path

from harness.files.strict_yaml import InputError


def shipped_scenarios() -> dict[str, Path]:
    """Scenario files by name."""
    return {path.stem: path for path in sorted(_folder().glob("*.yaml"))}


def shipped_worlds() -> dict[str, Path]:
    """Scenario files of the benchmark worlds by family and name, such as `barn/barn-world-006`."""
    folder = _folder() / "worlds"
    return {f"{path.parent.name}/{path.stem}": path for path in sorted(folder.glob("*/*.yaml"))}


def shipped_campaigns() -> dict[str, Path]:
    """Campaign files by name."""
    return {path.stem: path for path in sorted(_folder().joinpath("campaigns").glob("*.yaml"))}


def campaign_path(text: str) -> Path:
    """The file that a command's CAMPAIGN means: a path, or the name or path of a shipped campaign.

    Raises:
        InputError: there is neither such a file nor such a shipped campaign.
    """
    path, shipped = Path(text), shipped_campaigns()
    if path.is_file():
        return path
    inside = path.parent in (Path(), Path("scenarios/campaigns")) and path.suffix in ("", ".yaml")
    if inside and path.stem in shipped and not path.exists():
        return shipped[path.stem]
    what = "is not a file" if path.exists() else "no such file"
    raise InputError(f"{text}: {what}; give a campaign file or one of {', '.join(shipped)}")


def scenario_path(text: str) -> Path:
    """The file that a command's SCENARIO means: a path, or the name or path of a shipped scenario.

    `paper_circles` and, where there is no such file, `scenarios/paper_circles.yaml` name a shipped one, and
    `barn/barn-world-006` names a benchmark world.

    Raises:
        InputError: there is neither such a file nor such a shipped scenario.
    """
    path, shipped = Path(text), shipped_scenarios()
    try:
        if path.is_file():
            return path
        path.exists()
    except OSError as error:
        raise InputError(
            f"{text}: cannot be read ({error.strerror}); give a scenario file or one of {', '.join(shipped)}"
        ) from error
    inside = path.parent in (Path(), Path("scenarios")) and path.suffix in ("", ".yaml")
    if inside and path.stem in shipped and not path.exists():
        return shipped[path.stem]
    if not path.exists() and text in (worlds := shipped_worlds()):
        return worlds[text]
    if path.exists():
        raise InputError(f"{text}: is not a file; give a scenario file or one of {', '.join(shipped)}")
    raise InputError(f"{text}: no such file; give a scenario file or one of {', '.join(shipped)}")


def summary(path: Path) -> str:
    """What a scenario is for: the first line of the comment it begins with, the one for editors left out."""
    with path.open(encoding="utf-8") as file:
        line = next(line for line in file if not line.startswith("# yaml-language-server:"))
        return line.lstrip("# ").rstrip()


def _folder() -> Path:
    """In a wheel it lies in this package, in a checkout beside it."""
    here = Path(__file__).parents[1]
    return here / "scenarios" if (here / "scenarios").is_dir() else here.parent / "scenarios"
