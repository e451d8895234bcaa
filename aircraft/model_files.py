"""Where an aircraft's JSBSim files lie, and a digest of all that its flight depends on."""

from __future__ import annotations

import hashlib
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

from aircraft.actuators.actuator import NormActuator
from aircraft.deviation import AS_MODELLED, Deviation
from aircraft.foreign_model import faults

OWN = Path(__file__).parent


class AircraftError(ValueError):
    """An aircraft that cannot be flown as asked; the message is a sentence for the user."""


class TrimError(AircraftError):
    """There is no level flight at the airspeed and altitude."""


@dataclass(frozen=True)
class ModelFiles:
    """The files of one JSBSim model.

    Attributes:
        model: its main file, <folder>/<name>.xml.
        engines: folder that its engines and propellers are read from.
        systems: folder that its shared systems are read from.
        actuators: controls, and what moves each where it does not do what it is told at once.
        deviation: by how much the flown aircraft differs; no survey is flown with it.
        latency_s: age of the attitude, airspeed, height and climb that the autopilot works with.
    """

    model: Path
    engines: Path
    systems: Path
    actuators: tuple[tuple[str, NormActuator], ...] = ()
    deviation: Deviation = AS_MODELLED
    latency_s: float = 0.0

    @property
    def name(self) -> str:
        """What JSBSim calls it."""
        return self.model.stem

    def digest(self) -> str:
        """SHA-256 over the model, what it is flown with and what flies it.

        These are all files of its folder and of those of its engines and systems, JSBSim's version (it stands for
        the files of its wheel), its actuators, and this package, with autopilot, airframe table and guidance.
        """
        sha = hashlib.sha256(version("jsbsim").encode())
        sha.update(repr(self.actuators).encode() if self.actuators else b"")
        sha.update(repr(self.latency_s).encode() if self.latency_s else b"")
        known = (self.model.parent, OWN, _wheel())
        shared = {each for each in (self.engines, self.systems) if not any(map(each.is_relative_to, known))}
        for folder in (self.model.parent, OWN, *sorted(shared)):
            for path in sorted(_content(folder)):
                sha.update(f"\0{path.relative_to(folder).as_posix()}\0".encode())
                sha.update(path.read_bytes())
        return sha.hexdigest()


def model_files(name: str) -> ModelFiles:
    """The files of an aircraft.

    Args:
        name: of a model of this package or of the JSBSim wheel, or a folder that holds a model:
            <folder>/<its name>.xml, or the only JSBSim model among its XML files.

    Raises:
        AircraftError: there is no such model.
    """
    wheel = _wheel()
    if Path(name).name == name:
        for home in (OWN, wheel / "aircraft"):
            main = home / name / f"{name}.xml"
            if main.is_file():
                return _with_engines(main, wheel)
    folder = _folder(name)
    if folder is None:
        raise AircraftError(f"unknown aircraft {name[:100]!r}")
    _refuse(folder)
    found = _with_engines(_main_file(folder), wheel)
    for other in (found.engines, found.systems):
        if not other.is_relative_to(wheel) and not other.is_relative_to(folder):
            _refuse(other)
    return found


def _folder(name: str) -> Path | None:
    """The folder that a name means; None if it means none."""
    try:
        folder = Path(name).expanduser()
        return folder.resolve() if folder.is_dir() else None
    except (OSError, RuntimeError):  # too long, not allowed, or the home of nobody
        return None


def _refuse(folder: Path) -> None:
    """Raises AircraftError if a folder holds what must not be loaded."""
    for fault in faults(folder):
        raise AircraftError(fault)


@cache
def _wheel() -> Path:
    """Folder of the JSBSim wheel, found without importing it."""
    spec = find_spec("jsbsim")
    if spec is None or spec.origin is None:
        raise AircraftError("JSBSim is not installed")
    return Path(spec.origin).parent


def _main_file(folder: Path) -> Path:
    main = folder / f"{folder.name}.xml"
    if main.is_file():
        return main
    models = [path for path in sorted(folder.glob("*.xml")) if _root_tag(path) == "fdm_config"]
    if len(models) == 1:
        return models[0]
    have = "no JSBSim model" if not models else f"{len(models)} JSBSim models"
    raise AircraftError(f"{folder} holds {have}; must hold {folder.name}.xml with the root <fdm_config>")


def _root_tag(path: Path) -> str:
    try:
        return str(next(element.tag for _, element in ElementTree.iterparse(path, events=("start",))))
    except (ElementTree.ParseError, OSError):
        return ""


def _with_engines(main: Path, wheel: Path) -> ModelFiles:
    """Engines beside the model or in the tree that it is part of go before those of the wheel."""
    tree = main.parent.parent.parent
    wanted = _engine_names(main)
    places = (main.parent, main.parent / "engine", tree / "engine")
    near = (place for place in places if wanted and all((place / f"{e}.xml").is_file() for e in wanted))
    systems = tree / "systems" if (tree / "systems").is_dir() else wheel / "systems"
    return ModelFiles(main, next(near, wheel / "engine"), systems)


def _engine_names(main: Path) -> set[str]:
    try:
        root = ElementTree.parse(main).getroot()
    except ElementTree.ParseError:
        return set()  # whoever loads the model says where it is broken
    named = (*root.iterfind("propulsion/engine"), *root.iterfind("propulsion/engine/thruster"))
    return {file.removesuffix(".xml") for element in named if (file := element.get("file"))}


def _content(folder: Path) -> Iterator[Path]:
    return (
        path
        for path in folder.rglob("*")
        if path.is_file()
        and path.suffix != ".md"
        and not any(part.startswith((".", "__")) for part in path.relative_to(folder).parts)
    )
