"""Gazebo worlds, those of the BARN navigation challenge among them: the solids of their models, seen from above.

The format: http://sdformat.org/spec.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np

from harness.files.wording import counted
from harness.world_files.bounded import MAX_TREE_BYTES, read_bytes, xml_events
from harness.world_files.parts import Contents, FloatArray, Part, Reading, WorldFileError

POPULATION: Final = "population"
"""Copies of a model, as Gazebo spreads them."""
BARN_CELL_M: Final = 0.15
"""Side of a cell of the BARN worlds: the diameter of their cylinders (Perille et al. 2020)."""
UPRIGHT: Final = 0.01
"""Radians that a solid may lean and still be seen from above as one that stands: saved worlds have settled a little."""
ROUND: Final = 32
"""Corners of a circle, which lies inside of their polygon."""
OWN_FRAMES: Final = ("", "world", "__model__", "__default__")
"""What a pose may be relative to and be what it is without that."""


@dataclass
class _Passed:
    """What of a world is not taken as it stands.

    Attributes:
        shapes: collisions of no kind that is read, planes apart.
        relative: poses relative to other frames.
        scaled: models that the state of the world scales.
        changed: models that the state of the world adds or takes out.
        moved: models that lie where the state of the world puts them.
    """

    shapes: int = 0
    seen: int = 0
    spread: int = 0
    relative: int = 0
    scaled: int = 0
    changed: int = 0
    moved: int = 0
    states: dict[str, FloatArray] = field(default_factory=dict)

    def notes(self) -> list[str]:
        """A sentence each."""
        told = (
            (self.shapes, "shape", "other than boxes, cylinders, spheres and capsules passed over"),
            (self.seen, "link", "without a collision, which is only seen, passed over"),
            (self.spread, "population", "of models, put at random by Gazebo, passed over"),
            (self.moved, "model", "put where the saved state of the world has it"),
            (self.scaled, "model", "scaled by the saved state of the world: taken as large as defined"),
            (self.changed, "model", "added or taken out by the saved state of the world: passed over"),
            (self.relative, "pose", "relative to another frame: taken as one in its own"),
        )
        return [f"{counted(number, what)} {sentence}" for number, what, sentence in told if number]


def read(path: Path, reading: Reading) -> Contents:
    """Reads the solids of the models of a Gazebo world. A saved state puts models elsewhere, as Gazebo has it.

    `metres_per_cell` scales it: a cell is the diameter of a BARN cylinder, 0.15 m.

    Raises:
        WorldFileError: it is not whole XML, or has nothing solid.
    """
    scale = (reading.metres_per_cell or BARN_CELL_M) / BARN_CELL_M
    data = read_bytes(path, MAX_TREE_BYTES)
    passed, parts, included = _Passed(), list[Part](), 0
    if b"<state" in data:
        _read_state(data, passed)
    depth, in_state = 0, False
    for event, element in xml_events(data, ends_only=False):
        if element.tag in ("state", POPULATION):
            in_state = event == "start"
            passed.spread += element.tag == POPULATION and in_state
        included += element.tag == "include" and event == "end" and not in_state
        if element.tag != "model" or in_state:
            continue
        depth += 1 if event == "start" else -1
        if event == "end" and depth == 0:
            parts += _model(element, scale, passed)
            element.clear()
    if not parts:
        raise WorldFileError("has no box, cylinder or sphere; must be a Gazebo world with some")
    notes = passed.notes()
    if included:
        notes.append(f"{counted(included, 'model')} of other files passed over")
    if not reading.metres_per_cell:
        notes.append("a cell is taken as 0.15 m (metres_per_cell)")
    return Contents("gazebo_world", None, tuple(parts), notes=tuple(notes))


def _read_state(data: bytes, passed: _Passed) -> None:
    """Where the state of a world has its models, by name."""
    depth, in_state, inserted = 0, False, False
    for event, element in xml_events(data, ends_only=False):
        if element.tag == "state":
            in_state = event == "start"
        if not in_state:
            if event == "end":
                element.clear()
            continue
        if element.tag == "insertions":
            inserted = event == "start"
        if element.tag == "deletions" and event == "end":
            passed.changed += len(element.findall("name"))
        if element.tag != "model":
            continue
        depth += 1 if event == "start" else -1
        if event == "start" or depth:
            continue
        if inserted:
            passed.changed += 1
        elif element.find("pose") is not None:
            passed.states[element.get("name", "")] = _pose(element, passed)
        scale = (element.findtext("scale") or "1").split()
        passed.scaled += any(each not in ("1", "1.0") for each in scale)


def _model(model: ElementTree.Element, scale: float, passed: _Passed) -> list[Part]:
    """The solids of a model and of those that lie in it."""
    name, pose = model.get("name", ""), _pose(model, passed)
    if (state := passed.states.get(name)) is not None:
        passed.moved += not np.allclose(state, pose, atol=1e-3)
        pose = state
    return [Part(shape, name=name[:40]) for shape in _shapes(model, pose, scale, passed)]


def _shapes(model: ElementTree.Element, pose: FloatArray, scale: float, passed: _Passed) -> list[Any]:
    found: list[Any] = []
    for link in model.findall("link"):
        at = pose @ _pose(link, passed)
        passed.seen += link.find("collision") is None and link.find("visual") is not None
        for collision in link.findall("collision"):
            shape = _solid(collision, at @ _pose(collision, passed))
            passed.shapes += shape is None and collision.find("geometry/plane") is None
            found += [] if shape is None else [shape]
    if scale != 1.0:
        from shapely import affinity

        found = [affinity.scale(each, scale, scale, origin=(0, 0)) for each in found]
    for inner in model.findall("model"):
        found += _shapes(inner, pose @ _pose(inner, passed), scale, passed)
    return found


def _pose(element: ElementTree.Element, passed: _Passed) -> FloatArray:
    """(4, 4) from the frame of an element to that of what holds it.

    Raises:
        WorldFileError: it is not six finite numbers, or seven of a quaternion.
    """
    given = element.find("pose")
    text = "" if given is None else given.text or ""
    says = {} if given is None else given.attrib
    quaternion = says.get("rotation_format", "") == "quat_xyzw"
    wanted = 7 if quaternion else 6
    try:
        numbers = [float(each) for each in text.split()] or [0.0] * 6 + [1.0] * quaternion
    except ValueError as error:
        raise WorldFileError(f"has the pose {text[:40]!r}; must be {wanted} numbers") from error
    if len(numbers) != wanted or not all(map(math.isfinite, numbers)):
        raise WorldFileError(f"has the pose {text[:40]!r}; must be {wanted} finite numbers")
    passed.relative += (says.get("relative_to") or says.get("frame") or "") not in OWN_FRAMES
    matrix = np.eye(4)
    if quaternion:
        matrix[:3, :3] = _of_quaternion(*numbers[3:])
    else:
        turns = np.radians(numbers[3:]) if says.get("degrees") in ("true", "1") else np.array(numbers[3:])
        matrix[:3, :3] = _of_angles(*turns.tolist())
    matrix[:3, 3] = numbers[:3]
    return matrix


def _of_angles(roll: float, pitch: float, yaw: float) -> FloatArray:
    """(3, 3) a turn about x, then y, then z, all of them fixed."""
    (cr, cp, cy), (sr, sp, sy) = np.cos((roll, pitch, yaw)), np.sin((roll, pitch, yaw))
    about_x = np.array(((1.0, 0.0, 0.0), (0.0, cr, -sr), (0.0, sr, cr)))
    about_y = np.array(((cp, 0.0, sp), (0.0, 1.0, 0.0), (-sp, 0.0, cp)))
    about_z = np.array(((cy, -sy, 0.0), (sy, cy, 0.0), (0.0, 0.0, 1.0)))
    turned: FloatArray = about_z @ about_y @ about_x
    return turned


def _of_quaternion(x: float, y: float, z: float, w: float) -> FloatArray:
    size = math.hypot(x, y, z, w)
    if size == 0.0:
        raise WorldFileError("has a pose whose quaternion is zero; must be a turn")
    x, y, z, w = (each / size for each in (x, y, z, w))
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
        )
    )


def _solid(collision: ElementTree.Element, pose: FloatArray) -> Any:
    """A solid seen from above; None of what is none that is read."""
    import shapely
    from shapely import affinity

    geometry = collision.find("geometry")
    kind = next(iter(geometry), None) if geometry is not None else None
    if kind is None or kind.tag not in ("box", "cylinder", "sphere", "capsule"):
        return None
    try:
        size = [float(each) for each in (kind.findtext("size") or "").split()]
        radius, length = (float(kind.findtext(name) or 0.0) for name in ("radius", "length"))
    except ValueError as error:
        raise WorldFileError(f"has a {kind.tag} whose size is no number") from error
    if not all(map(math.isfinite, (*size, radius, length))):
        raise WorldFileError(f"has a {kind.tag} whose size is not finite")
    if not (min(size) > 0.0 if len(size) == 3 else radius > 0.0):
        return None
    stands = pose[2, 2] >= math.cos(UPRIGHT)
    if stands or kind.tag == "sphere":
        if kind.tag == "box":
            shape = shapely.box(-size[0] / 2, -size[1] / 2, size[0] / 2, size[1] / 2)
        else:
            # Circumscribed: no point of the disc is left out.
            shape = shapely.Point(0, 0).buffer(radius / math.cos(math.pi / ROUND), quad_segs=ROUND // 4)
        if kind.tag != "sphere" and (yaw := math.atan2(pose[1, 0], pose[0, 0])):
            shape = affinity.rotate(shape, yaw, origin=(0, 0), use_radians=True)
        return affinity.translate(shape, *pose[:2, 3].tolist())
    seen = _corners(kind.tag, size, radius, length) @ pose[:3, :3].T + pose[:3, 3]
    hull = shapely.MultiPoint(seen[:, :2]).convex_hull
    return (
        hull.buffer(radius / math.cos(math.pi / ROUND), quad_segs=ROUND // 4)
        if kind.tag == "capsule"
        else hull
    )


def _corners(kind: str, size: list[float], radius: float, length: float) -> FloatArray:
    """(n, 3) points whose hull a box or a cylinder lies in; the ends of the axis of a capsule."""
    if kind == "box":
        signs = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
        corners: FloatArray = signs * size
        return corners
    if kind == "capsule":
        return np.array(((0.0, 0.0, -length / 2), (0.0, 0.0, length / 2)))
    around = np.arange(ROUND) * math.tau / ROUND
    ring = np.column_stack((np.cos(around), np.sin(around))) * radius / math.cos(math.pi / ROUND)
    return np.vstack([np.column_stack((ring, np.full(ROUND, z))) for z in (-length / 2, length / 2)])
