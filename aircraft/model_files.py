"""Where an aircraft's JSBSim files lie, what keeps them from being loaded, and a digest of what a flight depends on.

JSBSim reads XML with nothing to bound it: a deep file overflows its stack, and what a file refers to may lie anywhere.
So somebody's folder is looked through first, its XML by expat, without building a tree.
"""

from __future__ import annotations

import hashlib
import os
import xml.etree.ElementTree as ElementTree
import xml.parsers.expat as expat
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from itertools import islice
from pathlib import Path, PurePath

from aircraft.actuators import NormActuator
from aircraft.deviation import AS_MODELLED, Deviation

Stamp = tuple[tuple[int, int], ...]
OWN_FOLDER = Path(__file__).parent  # this package, which holds the shipped aircraft
MAX_FILES = 1000  # a model's folder with more files and folders than this is refused
MAX_BYTES = 5_000_000  # an XML file of a model that is larger than this is refused
MAX_FOLDER_BYTES = 200_000_000
"""A model's folder whose files have more bytes than this together is refused; all of them go into the digest."""
MAX_ENTITY_LETTERS = 100  # an XML entity that stands for a longer text than this is refused
MAX_DEPTH = 60
"""A model's XML with elements nested deeper than this is refused; the deepest of JSBSim's own models has 13."""

ELECTRIC = {"electric_engine", "brushless_dc_motor"}  # root elements of JSBSim's files of engines
PROPELLER_NUMBERS = "ixx diameter numblades gearratio minpitch maxpitch minrpm maxrpm constspeed reversepitch tableData"
"""Elements of a propeller that hold numbers. JSBSim ends the process where one of them holds none."""
WRITTEN_OUT = ("mass_balance", "propulsion", "aerodynamics", "external_reactions", "ground_reactions")
"""Sections of a model that are read or changed here, wherever they stand."""


class AircraftError(ValueError):
    """An aircraft that cannot be flown as asked; the message is a sentence for the user."""


class TrimError(AircraftError):
    """There is no level flight at the airspeed and altitude."""


@dataclass(frozen=True)
class ModelFiles:
    """The files of one JSBSim model, and what they are flown with."""

    model: Path  # <folder>/<name>.xml
    engines: tuple[tuple[str, Path], ...]  # the file of each of its engines and propellers, by the name it has there
    systems: Path  # folder of its shared systems
    actuators: tuple[tuple[str, NormActuator], ...] = ()  # controls that do not follow their commands at once
    deviation: Deviation = AS_MODELLED  # of the flown aircraft; no survey is flown with it
    latency_s: float = 0.0  # age of the attitude, airspeed, height and climb that the autopilot works with
    stamp: Stamp = ()  # as `folder_stamp`: what is cached of other files than these is not theirs

    @property
    def name(self) -> str:
        """The model's name in JSBSim."""
        return self.model.stem

    @property
    def has_electric_propeller(self) -> bool:
        """Whether it has an electric engine and a propeller of JSBSim's."""
        roots = {_root(file).tag for _, file in self.engines}
        return "propeller" in roots and not roots.isdisjoint(ELECTRIC)

    def digest(self) -> str:
        """SHA-256 over the model, what it is flown with and what flies it: JSBSim's version stands for its wheel."""
        sha = hashlib.sha256(version("jsbsim").encode())
        sha.update(repr(self.actuators).encode() if self.actuators else b"")
        sha.update(repr(self.latency_s).encode() if self.latency_s else b"")
        known = (self.model.parent, OWN_FOLDER, _wheel())
        places = (*(file.parent for _, file in self.engines), self.systems)
        shared = {each for each in places if not any(map(each.is_relative_to, known))}
        for folder in (self.model.parent, OWN_FOLDER, *sorted(shared)):
            for path in sorted(each for each in folder.rglob("*") if each.is_file() and each.suffix != ".md"):
                place = path.relative_to(folder)
                if not any(part.startswith((".", "__")) for part in place.parts):
                    sha.update(f"\0{place.as_posix()}\0".encode())
                    sha.update(path.read_bytes())
        return sha.hexdigest()


def model_files(name: str) -> ModelFiles:
    """The files of a model of this package or of the JSBSim wheel, or of a folder; AircraftError if there is none.

    A folder holds <its name>.xml, or else one JSBSim model among its XML files.
    """
    wheel = _wheel()
    folder = None
    with suppress(OSError, RuntimeError):  # too long, not allowed, or the home of nobody
        for home in (OWN_FOLDER, wheel / "aircraft") if Path(name).name == name else ():
            if (main := home / name / f"{name}.xml").is_file():
                return _with_engines(main, wheel)
        if Path(name).expanduser().is_dir():
            folder = Path(name).expanduser().resolve()
    if folder is None:
        raise AircraftError(f"unknown aircraft {name[:100]!r}")
    _check_folder(folder)
    found = _with_engines(_model_in(folder), wheel)
    for other in {*(file.parent for _, file in found.engines), found.systems}:
        if not other.is_relative_to(wheel) and not other.is_relative_to(folder):
            _check_folder(other)
    for _, file in found.engines:
        _check_propeller(file)
    return replace(found, stamp=folder_stamp(name))


def folder_stamp(name: str) -> Stamp:
    """Sizes and times of change of what lies in an aircraft's folder; nothing for a name."""
    with suppress(OSError, RuntimeError):  # `model_files` says why
        found = sorted(islice(Path(name).expanduser().rglob("*"), MAX_FILES + 1)) if os.sep in name else ()
        return tuple((each.lstat().st_size, each.lstat().st_mtime_ns) for each in found)
    return ()


def _check_folder(folder: Path) -> None:
    """Raises AircraftError if a folder is too large, leads out of itself or holds bad XML; reads only regular files."""
    found = (Path(home, name) for home, inner, names in os.walk(folder) for name in sorted((*inner, *names)))
    size = 0
    for number, path in enumerate(islice(found, MAX_FILES + 1)):
        if number == MAX_FILES:
            wanted = "must be the folder of one aircraft"
            raise AircraftError(f"{folder}: has more than {MAX_FILES} files; {wanted}")
        if path.is_symlink() and not path.resolve().is_relative_to(folder.resolve()):
            wanted = "must be a file or folder in it"
            raise AircraftError(f"{path}: is a link that leads out of the folder; {wanted}")
        if not path.is_file():
            continue
        size += path.stat().st_size
        if size > MAX_FOLDER_BYTES:
            text = f"{size / 1e6:.0f} MB; must be at most {MAX_FOLDER_BYTES // 10**6} MB together"
            raise AircraftError(f"{path}: with it the files of {folder} have {text}")
        if path.suffix.lower() == ".xml":
            if path.stat().st_size > MAX_BYTES:
                raise AircraftError(f"{path}: is larger than {MAX_BYTES // 10**6} MB; must be a JSBSim file")
            _check_xml(path)


def _check_propeller(path: Path) -> None:
    """Raises AircraftError if an engine's or propeller's file is broken, or a propeller's number is none or missing."""
    try:
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError as error:
        raise AircraftError(f"{path} is not well-formed XML: {error}") from None
    if root.tag == "propeller" and (missing := [each for each in ("ixx", "diameter") if root.find(each) is None]):
        raise AircraftError(f"{path}: has no {missing[0]}; must have one: JSBSim has no default")
    for element in root.iter() if root.tag == "propeller" else ():
        for text in (element.text or "").split() if element.tag in PROPELLER_NUMBERS.split() else ():
            try:
                float(text)
            except ValueError:
                raise AircraftError(f"{path}: {element.tag} has {text[:40]!r}; must be a number") from None


def _check_xml(path: Path) -> None:
    """Raises AircraftError if an XML file is deep, refers to other places, or has entities that grow."""
    parser, depth = expat.ParserCreate(), 0

    def fault(text: str) -> AircraftError:
        return AircraftError(f"{path}:{parser.CurrentLineNumber}: {text}")

    def begin(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > MAX_DEPTH:
            raise fault(f"is nested deeper than {MAX_DEPTH} elements; must be flatter")
        file = PurePath(attributes.get("file", ""))
        if file.is_absolute() or ".." in file.parts:
            link = f'<{name:.40} file="{str(file)[:80]}"> leads out of the folder'
            raise fault(f"{link}; copy the file into it and give its name")

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1

    def entity(name: str, parameter: bool, value: str | None, *_: object) -> None:
        if parameter or value is None or "&" in value or len(value) > MAX_ENTITY_LETTERS:
            raise fault(f"declares the entity {name:.40}, which is not a short text of its own; write it out")

    parser.StartElementHandler, parser.EndElementHandler, parser.EntityDeclHandler = begin, end, entity
    try:
        parser.Parse(path.read_bytes(), True)
    except expat.ExpatError:
        return  # whoever loads the model says where it is broken
    except OSError as error:
        raise AircraftError(f"{path}: cannot be read ({error.strerror})") from None


@cache
def _wheel() -> Path:
    """Folder of the JSBSim wheel, found without importing it."""
    spec = find_spec("jsbsim")
    if spec is None or spec.origin is None:
        raise AircraftError("JSBSim is not installed")
    return Path(spec.origin).parent


def _model_in(folder: Path) -> Path:
    """The file of the one JSBSim model in a folder; AircraftError if there is none, or several."""
    if (main := folder / f"{folder.name}.xml").is_file():
        return main
    models = [path for path in sorted(folder.glob("*.xml")) if _root(path).tag == "fdm_config"]
    if len(models) == 1:
        return models[0]
    have = "no JSBSim model" if not models else f"{len(models)} JSBSim models"
    raise AircraftError(f"{folder} holds {have}; must hold {folder.name}.xml with the root <fdm_config>")


def _root(path: Path) -> ElementTree.Element:
    """Reads a file's root element, of broken XML up to the fault: loading the model then says where it is."""
    root = ElementTree.Element("broken")
    with suppress(ElementTree.ParseError, OSError, StopIteration):
        elements = ElementTree.iterparse(path, events=("start",))
        _, root = next(elements)
        for _ in elements:
            pass
    return root


def whole_model(main: Path) -> ElementTree.Element:
    """The root of a model, its `WRITTEN_OUT` sections that stand in files written out, as JSBSim reads them.

    A model that is not well-formed raises ElementTree.ParseError; of a section's file JSBSim says it.
    """
    root = ElementTree.fromstring(main.read_bytes())
    _write_out(root, main.parent)
    return root


def _write_out(root: ElementTree.Element, folder: Path) -> None:
    for section in (each for each in root if each.tag in WRITTEN_OUT and each.get("file")):
        with suppress(ElementTree.ParseError, OSError):
            whole = ElementTree.parse(folder / f"{section.attrib['file'].removesuffix('.xml')}.xml").getroot()
            if whole.tag == section.tag:
                section.attrib = {**whole.attrib, **section.attrib}
                del section.attrib["file"]
                section.extend(whole)


def _with_engines(main: Path, wheel: Path) -> ModelFiles:
    """Finds engines, propellers and systems of a model: each beside it or in its tree, else in the JSBSim wheel."""
    root, tree = _root(main), main.parent.parent.parent
    _write_out(root, main.parent)
    named = (*root.iterfind("propulsion/engine"), *root.iterfind("propulsion/engine/thruster"))
    wanted = {file.removesuffix(".xml") for element in named if (file := element.get("file"))}
    places = (main.parent / "Engines", main.parent, main.parent / "engine", tree / "engine", wheel / "engine")
    files = [(f"{name}.xml", place / f"{name}.xml") for name in sorted(wanted) for place in reversed(places)]
    engines = {name: file for name, file in files if file.is_file()}  # the nearest comes last
    systems = tree / "systems" if (tree / "systems").is_dir() else wheel / "systems"
    return ModelFiles(main, tuple(engines.items()), systems)
