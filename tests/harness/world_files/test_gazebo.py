"""Gazebo worlds as others save them: states, nested models, leaning solids, other ways to write a pose."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from harness.world_files.kinds import read
from harness.world_files.parts import Contents, Reading, WorldFileError

BOX = "<box><size>4 2 6</size></box>"


def solid(geometry: str = BOX, pose: str = "") -> str:
    """A link with one collision."""
    return f"<link name='l'><collision name='c'>{pose}<geometry>{geometry}</geometry></collision></link>"


def model(name: str, body: str, pose: str = "") -> str:
    return f"<model name='{name}'>{pose}{body}</model>"


def world(tmp_path: Path, body: str) -> Contents:
    path = tmp_path / "a.world"
    path.write_text(f"<sdf version='1.9'><world name='default'>{body}</world></sdf>")
    return read(path, None, Reading(metres_per_cell=0.15))


def bounds(found: Contents, number: int = 0) -> tuple[float, ...]:
    return tuple(float(each) for each in found.parts[number].footprint.bounds)


@pytest.mark.parametrize(
    ("pose", "wanted"),
    [
        ("<pose>10 20 3 0 0 0</pose>", (8, 19, 12, 21)),
        ("<pose degrees='true'>10 20 3 0 0 90</pose>", (9, 18, 11, 22)),
        ("<pose>10 20 3 0 0 1.5707963</pose>", (9, 18, 11, 22)),
        ("<pose rotation_format='quat_xyzw'>10 20 3 0 0 0.70710678 0.70710678</pose>", (9, 18, 11, 22)),
        ("<pose>10 20 3 1.5707963 0 0</pose>", (8, 17, 12, 23)),  # on its side
        ("<pose>10 20 3 0 1.5707963 0</pose>", (7, 19, 13, 21)),
        ("<pose degrees='true'>10 20 3 90 0 90</pose>", (7, 18, 13, 22)),
        ("<pose>10 20 3 3.14159265 0 0</pose>", (8, 19, 12, 21)),  # upside down
    ],
)
def test_a_box_is_where_its_pose_puts_it(pose: str, wanted: tuple[float, ...], tmp_path: Path) -> None:
    assert bounds(world(tmp_path, model("a", solid(), pose))) == pytest.approx(wanted, abs=1e-6)


def test_a_saved_state_puts_models_elsewhere(tmp_path: Path) -> None:
    body = model("a", solid(), "<pose>1 2 0 0 0 0</pose>") + model("b", solid(), "<pose>50 0 0 0 0 0</pose>")
    state = (
        "<state world_name='default'><model name='a'><pose frame=''>10 20 3 0 -0 0</pose><scale>1 1 1</scale>"
        "<link name='l'><pose>10 20 3 0 0 0</pose></link></model>"
        "<model name='b'><pose>50 0 0 0 0 1e-05</pose><scale>2 1 1</scale></model>"
        "<insertions><model name='c'><pose>0 0 0 0 0 0</pose></model></insertions></state>"
    )
    found = world(tmp_path, body + state)
    assert bounds(found) == pytest.approx((8, 19, 12, 21))
    assert bounds(found, 1) == pytest.approx((48, -1, 52, 1), abs=1e-3)
    assert found.notes == (
        "1 model put where the saved state of the world has it",
        "1 model scaled by the saved state of the world: taken as large as defined",
        "1 model added or taken out by the saved state of the world: passed over",
    )
    assert world(tmp_path, state + body).notes == found.notes


def test_a_model_within_a_model_moves_with_it(tmp_path: Path) -> None:
    inner = model("inner", solid(), "<pose>10 0 0 0 0 0</pose>")
    found = world(tmp_path, model("outer", inner + solid(), "<pose>100 0 0 0 0 1.5707963</pose>"))
    assert len(found.parts) == 2
    assert sorted(bounds(found, number)[1] for number in (0, 1)) == pytest.approx([-2.0, 8.0], abs=1e-6)


def test_solids_that_are_round(tmp_path: Path) -> None:
    for geometry, pose, area in (
        ("<sphere><radius>2</radius></sphere>", "", math.pi * 4),
        ("<cylinder><radius>2</radius><length>10</length></cylinder>", "", math.pi * 4),
        (
            "<cylinder><radius>2</radius><length>10</length></cylinder>",
            "<pose>0 0 0 0 1.5707963 0</pose>",
            40,
        ),
        ("<capsule><radius>2</radius><length>10</length></capsule>", "", math.pi * 4),
        (
            "<capsule><radius>2</radius><length>10</length></capsule>",
            "<pose>0 0 0 0 1.5707963 0</pose>",
            40 + 4 * math.pi,
        ),
    ):
        (part,) = world(tmp_path, model("a", solid(geometry, pose))).parts
        assert area <= part.footprint.area * (1 + 1e-9), geometry
        assert part.footprint.area == pytest.approx(area, rel=0.01), geometry


def test_what_is_not_taken_is_told(tmp_path: Path) -> None:
    mesh = "<mesh><uri>model://a.dae</uri></mesh>"
    pose = "<pose relative_to='other'>1 0 0 0 0 0</pose>"
    found = world(tmp_path, model("a", solid() + solid(mesh), pose) + model("g", solid("<plane/>")))
    assert found.notes == (
        "1 shape other than boxes, cylinders, spheres and capsules passed over",
        "1 pose relative to another frame: taken as one in its own",
    )
    for body, said in (
        (solid("<box><size>1 x 1</size></box>"), "has a box whose size is no number"),
        (solid("<sphere><radius>nan</radius></sphere>"), "has a sphere whose size is not finite"),
        (solid("<box><size>1 0 1</size></box>"), "has no box, cylinder or sphere"),
        (solid(pose="<pose>1 2 3</pose>"), "has the pose '1 2 3'; must be 6 finite numbers"),
        (solid(pose="<pose rotation_format='quat_xyzw'>0 0 0 0 0 0 0</pose>"), "whose quaternion is zero"),
    ):
        with pytest.raises(WorldFileError, match=said):
            world(tmp_path, model("a", body))


def test_leaning_solids_cover_their_points(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    for roll, pitch, yaw in rng.uniform(-math.pi, math.pi, (20, 3)):
        (part,) = world(tmp_path, model("a", solid(), f"<pose>1 2 3 {roll} {pitch} {yaw}</pose>")).parts
        from scipy.spatial.transform import Rotation

        corners = np.array([(x, y, z) for x in (-2, 2) for y in (-1, 1) for z in (-3, 3)])
        seen = Rotation.from_euler("xyz", (roll, pitch, yaw)).apply(corners)[:, :2] + (1, 2)
        assert bounds(Contents("", None, (part,))) == pytest.approx(
            (*seen.min(axis=0), *seen.max(axis=0)), abs=1e-6
        )


def test_what_is_only_seen_and_what_gazebo_spreads_is_told(tmp_path: Path) -> None:
    """A population was taken as one model at the origin."""
    sight = model("sight", "<link name='l'><visual name='v'><geometry>" + BOX + "</geometry></visual></link>")
    crowd = f"<population name='p'>{model('tree', solid())}<model_count>5</model_count></population>"
    found = world(tmp_path, sight + crowd + model("wall", solid()))
    assert [part.name for part in found.parts] == ["wall"]
    assert found.notes == (
        "1 link without a collision, which is only seen, passed over",
        "1 population of models, put at random by Gazebo, passed over",
    )
