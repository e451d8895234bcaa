"""The scenarios that come with the package, by name."""

from __future__ import annotations

from pathlib import Path

from harness.files.strict_yaml import InputError


def shipped_scenarios() -> dict[str, Path]:
    """Scenario files by name."""
    return {path.stem: path for path in sorted(_folder().glob("*.yaml"))}


def shipped_worlds() -> dict[str, Path]:
    """Scenario files of the benchmark worlds by family and name, such as `barn/barn-world-006`."""
    return {f"{path.parent.name}/{path.stem}": path for path in sorted(_folder().glob("worlds/*/*.yaml"))}


def shipped_campaigns() -> dict[str, Path]:
    """Campaign files by name."""
    return {path.stem: path for path in sorted(_folder().glob("campaigns/*.yaml"))}


def campaign_path(text: str) -> Path:
    """The file that a command's CAMPAIGN means: a path, or the name or path of a shipped campaign."""
    return _path_or_shipped(text, shipped_campaigns(), Path("scenarios/campaigns"), "a campaign file")


def scenario_path(text: str) -> Path:
    """The file that a command's SCENARIO means: a path, or the name of a shipped scenario or world."""
    return _path_or_shipped(text, shipped_scenarios(), Path("scenarios"), "a scenario file")


def _path_or_shipped(text: str, shipped: dict[str, Path], folder: Path, what: str) -> Path:
    path, wanted = Path(text), f"give {what} or one of {', '.join(shipped)}"
    try:
        if path.is_file():
            return path
        if path.exists() or path.is_symlink():
            fault = "not a file" if path.exists() else "a link that leads to no file"
            raise InputError(f"{text}: is {fault}; {wanted}")
    except OSError as error:
        raise InputError(f"{text}: cannot be read ({error.strerror}); {wanted}") from error
    if path.parent in (Path(), folder) and path.suffix in ("", ".yaml") and path.stem in shipped:
        return shipped[path.stem]
    if text not in (worlds := shipped_worlds() if folder == Path("scenarios") else {}):
        raise InputError(f"{text}: no such file; {wanted}")
    return worlds[text]


def _folder() -> Path:
    """Folder of the shipped scenarios: in a wheel in this package, in a checkout beside it."""
    here = Path(__file__).parents[1]
    return here / "scenarios" if (here / "scenarios").is_dir() else here.parent / "scenarios"
