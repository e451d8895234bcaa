"""Missions gone through item by item, as an autopilot does."""

import math

import pytest

from harness.files.mavlink.items import Item
from harness.run_files.mission.program import Program, program
from harness.run_files.mission.vertices import altitude_m
from wayproof import InputError

HOME = (47.0, 8.0)


def item(number: int, command: int, *params: float, frame: int = 3) -> Item:
    return Item(f"m:{number}", number, command, frame, (*params, *(0.0,) * (7 - len(params))))


def at(number: int, command: int = 16, height: float = 100.0, first: float = 0.0, third: float = 0.0) -> Item:
    return item(number, command, first, 0.0, third, 0.0, 47.0 + 0.01 * number, 8.0, height)


def run(*items: Item) -> Program:
    return program("m", items, HOME, 400.0)


def flown(done: Program) -> list[int]:
    return [step.item for step in done.steps]


def told(done: Program) -> dict[int, tuple[str, str]]:
    return {each.item: (each.what, each.why) for each in done.items}


FORWARD = (item(1, 177, 4, -1), at(2), at(3), at(4), at(5), item(6, 177, 4, -1), at(7))
CLOSED = ("flown", "to item 4 without end: flown up to item 4 again")


@pytest.mark.parametrize(
    ("items", "steps", "says"),
    [
        ((at(1), at(2), at(3), item(4, 177, 2, 2), at(5)), [1, 2, 3, 2, 3, 2, 3, 5], {}),
        (FORWARD, [4, 5, 4], {6: CLOSED, **dict.fromkeys((2, 3, 7), ("not reached", ""))}),
        ((item(1, 177, 5, -1), at(4), at(5), item(6, 177, 4, -1)), [5, 4, 5, 4], {6: CLOSED}),
        ((at(1), at(2), at(3, 17), at(4)), [1, 2, 3], {}),
        ((at(1), at(2), at(3, 21, 0.0), at(4)), [1, 2, 3], {}),
        ((at(1), at(2), item(3, 20, frame=2), at(4)), [1, 2, 3], {}),
        ((item(1, 22, 15, 0, 0, 0, 0, 0, 60), at(2), at(3, 22)), [1, 2], {3: ("not flown", "in the air already")}),
    ],
)  # fmt: skip
def test_jumps_ends_and_takeoffs_say_what_is_flown(
    items: tuple[Item, ...], steps: list[int], says: dict[int, tuple[str, str]]
) -> None:
    done = run(*items)
    assert flown(done) == steps
    assert {number: told(done)[number] for number in says} == says


def test_a_jump_to_a_tag_goes_to_the_first_item_that_has_it() -> None:
    """As `AP_Mission::get_index_of_jump_tag` of ArduPilot finds it; it was refused."""
    items = (at(1), item(2, 600, 77), at(3), item(4, 600, 77), at(5), item(6, 601, 77, 1), at(7))
    assert flown(run(*items)) == [1, 3, 5, 3, 5, 7]
    with pytest.raises(InputError, match="item 6 jumps to tag 77, which does not exist; must be that"):
        run(at(1), at(3), item(6, 601, 77, 1))


def test_a_jump_in_a_loop_is_taken_as_often_in_every_lap() -> None:
    """ArduPilot, pull request 29763, zeroes the counter of a jump that is done; later laps were flown without it."""
    done = run(at(1), at(2), item(3, 177, 2, 1), at(4), item(5, 177, 1, 1), at(6))
    assert flown(done) == [1, 2, 2, 4, 1, 2, 2, 4, 6]
    said = "to item 2, 1 time whenever it is reached: ArduPilot before 4.7 and PX4 pass it by later"
    assert told(done)[3] == ("flown", said)
    assert told(done)[5] == ("flown", "to item 1, 1 time")


def test_speeds_hold_from_where_they_are_changed_and_minus_2_goes_back() -> None:
    """To that of the flight, as ArduPlane and MAVLink have it."""
    changes = {2: (0, 22), 5: (1, 30), 6: (0, -1), 8: (0, -2), 10: (1, -2)}
    done = run(*(item(k, 178, *changes[k]) if k in changes else at(k) for k in range(1, 12)))
    assert [step.airspeed_mps for step in done.steps] == [None, 22.0, None, None, 0.0, None]
    assert told(done)[5] == ("not flown", "a least ground speed of 30 m/s is not held")
    assert told(done)[6] == told(done)[10] == ("passed over", "changes no speed")
    assert told(done)[8] == ("flown", "back to the airspeed before any change")


def test_loiters_have_turns_or_time_or_an_altitude_and_a_side() -> None:
    done = run(
        at(1),
        at(2, 18, first=3, third=80),
        at(3, 19, first=60, third=-50),
        item(4, 31, 1, -70, 0, 0, 47, 8, 9),
    )
    loiters = [step.loiter for step in done.steps if step.loiter]
    assert [(each.turns, each.time_s, each.radius_m, each.clockwise) for each in loiters] == [
        (3.0, None, 80.0, True),
        (None, 60.0, 50.0, False),
        (None, None, 70.0, False),
    ]


@pytest.mark.parametrize(
    ("second", "what", "why"),
    [
        (item(2, 177, 1, 0), "passed over", "is never taken"),
        (item(2, 183, 7, 1430), "passed over", "no effect on the path"),
        (item(2, 206, 25), "passed over", "no effect on the path"),
        (item(2, 3000, 4), "passed over", "no effect on the path"),
        (item(2, 3000, 3), "not flown", "flown on as an aeroplane"),
        (item(2, 223, 0), "not flown", "the engine runs on"),
        (item(2, 31999), "not flown", "it is not simulated"),
        (item(2, 30), "not flown", "it is not simulated"),
        (item(2, 112, 9), "not flown", "what follows it up to the next leg is not held back"),
        (item(2, 42702, 1, 10), "not flown", "a script of the aircraft flies it"),
        (at(2, 36, first=90), "not flown", "an arc of a multicopter: ArduPlane goes on to the next item"),
        (at(2, third=80.0), "flown", "passing by or beyond it, 80 m, is not flown"),
        (at(2, 18, first=1.0), "flown", "1 turn"),
        (at(2, 82, third=8), "flown", "passing by or beyond it, 8 m, is not flown; as a plain waypoint"),
    ],
)
def test_what_becomes_of_an_item_is_told(second: Item, what: str, why: str) -> None:
    done = run(at(1), second, at(3))
    assert flown(done) == ([1, 2, 3] if what == "flown" else [1, 3])
    assert told(done) == {1: ("flown", ""), 2: (what, why), 3: ("flown", "")}
    assert (done.items[1].name == "command 31999") is (second.command == 31999)


def test_a_takeoff_and_a_return_are_at_home() -> None:
    done = run(item(1, 22, 15, 0, 0, 0, 0, 0, 60), at(2), item(3, 20, frame=2))
    assert (done.steps[0].position, done.steps[0].height_m, done.steps[-1].position) == (HOME, 60.0, HOME)


def test_an_item_without_a_place_is_where_the_one_before_was() -> None:
    loiter = run(at(1, height=120.0), item(2, 19, 30), at(3)).steps[1]
    assert (loiter.position, loiter.height_m) == (None, None)
    assert altitude_m(loiter, 400.0, math.nan, 520.0) == 520.0


@pytest.mark.parametrize(
    ("frame", "altitude"),
    [(0, 100.0), (5, 100.0), (2, 100.0), (3, 500.0), (6, 500.0), (10, 650.0), (11, 650.0)],
)
def test_frames_say_what_an_altitude_is_above(frame: int, altitude: float) -> None:
    step = run(item(1, 16, 0, 0, 0, 0, 47.1, 8, 100, frame=frame), at(2)).steps[0]
    assert altitude_m(step, 400.0, 550.0, math.nan) == altitude


def test_a_frame_that_says_nothing_of_altitudes_is_told() -> None:
    """ArduPilot takes it as above the sea: AP_Mission::mavlink_int_to_mission_cmd; the mission was refused."""
    said = "frame 2 says nothing of altitudes: above the sea, as ArduPilot has it"
    there = (0, 0, 0, 0, 47.1, 8, 100)
    done = run(item(1, 16, *there, frame=2), at(2), item(3, 18, 2, *there[1:], frame=2), item(4, 177, 1, 1))
    assert flown(done) == [1, 2, 3, 1, 2, 3]
    assert told(done)[1] == ("flown", said)
    assert told(done)[3] == ("flown", f"2 turns; {said}")
    done = run(at(1), item(2, 19, 30, frame=2), item(3, 20, frame=2))
    assert (told(done)[2], flown(done)) == (("flown", "30 s"), [1, 2, 3])


@pytest.mark.parametrize("frame", [1, 4, 7, 8, 9, 12, 20, 21])
def test_frames_that_autopilots_do_not_load_are_refused(frame: int) -> None:
    with pytest.raises(InputError, match=f"m:2: item 2 has the frame {frame}; must be one of 0, 2, 3, 5"):
        run(at(1), item(2, 16, 0, 0, 0, 0, 47.1, 8, 100, frame=frame))


@pytest.mark.parametrize("radius", [1.0, -1.0])
def test_a_radius_of_one_metre_is_a_side(radius: float) -> None:
    loiter = run(at(1), at(2, 19, first=45.0, third=radius)).steps[1].loiter
    assert loiter is not None
    assert (loiter.radius_m, loiter.clockwise) == (0.0, radius > 0)


def test_one_item_is_no_path() -> None:
    with pytest.raises(InputError, match=r"has 1 item to fly to \(land, item 1\); a path has at least 2"):
        run(at(1, 21))
