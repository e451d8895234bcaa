"""A flight as a MAVLink vehicle; pymavlink is the ground station."""

from __future__ import annotations

import math
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from aircraft.frames import LocalPlane
from aircraft.guidance.interface import GuidanceOutput
from aircraft.interface import AircraftState
from harness.cli.app import main
from harness.flight.closed_loop import NOT_STEERED, fly
from harness.flight.observer import Caution
from harness.flight.record import digest
from harness.run.scenario_flight import make_loop
from harness.watching import mavlink
from harness.watching.address import Address
from harness.watching.body_rates import body_rates_radps
from harness.watching.mavlink import EarthPosition, GroundStationLink
from harness.watching.mavlink_mission import PlanAsMission
from harness.watching.onlooker import Onlooker
from harness.watching.pace import Pace
from harness.watching.watched_flight import Onlookers, fly_watched
from tests.closed_loop.conftest import world
from tests.harness.conftest import MakePlan
from tests.point_mass import PointMass

pymavlink = pytest.importorskip("pymavlink")
PLANE = LocalPlane(47.0, 8.0)
STEERED = GuidanceOutput(0.0, 0.0, 2.5, bank_saturated=False, past_end=False)
TREE = {"circle": {"center_m": [1500.0, 1600.0], "radius_m": 200.0}}


class GroundStation:
    """Listens as QGroundControl does, and asks as it does."""

    def __init__(self) -> None:
        from pymavlink import mavutil

        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.link: Any = mavutil.mavlink_connection(f"udpin:127.0.0.1:{self.port}", source_system=255)
        self.heard: list[Any] = []

    @property
    def address(self) -> Address:
        return Address("127.0.0.1", self.port)

    @property
    def vehicle(self) -> Any:
        """Where the vehicle sends from."""
        return next(iter(self.link.clients))

    def listen(self) -> list[Any]:
        """What has come since the last time."""
        new = []
        while (message := self.link.recv_msg()) is not None:
            new.append(message)
        self.heard += new
        return new

    def close(self) -> None:
        self.link.close()


@pytest.fixture
def station() -> Iterator[GroundStation]:
    there = GroundStation()
    yield there
    there.close()


@pytest.fixture
def link(station: GroundStation, make_plan: MakePlan) -> Iterator[GroundStationLink]:
    """A vehicle with a mission along a line of 600 m to the east, that has flown a row."""
    link = GroundStationLink(station.address)
    link.begin(EarthPosition(PLANE, (0.0, 0.0), ground_m=100.0))
    link.on_plan(
        make_plan([(0.0, 0.0, 1.0, 0.0, 0.0, 300.0), (300.0, 0.0, 1.0, 0.0, 0.0, 300.0)]), state(0.0)
    )
    link.on_row(state(0.1), STEERED, 0)
    yield link
    link.close()


def state(time_s: float, **other: float) -> AircraftState:
    """Eastwards at 25 m/s, 300 m above the sea."""
    still = AircraftState(
        time_s, 25.0 * time_s, 0.0, 300.0, 25.0, 0.0, 0.5, math.pi / 2.0, 0.1, 0.05, 24.0, 1.0, 0.4
    )
    return still._replace(**other)


def test_state_and_mission_are_told(station: GroundStation, link: GroundStationLink) -> None:
    heard = {message.get_type(): message for message in station.listen()}
    assert heard["HEARTBEAT"].type == 1
    assert heard["HEARTBEAT"].base_mode & 128
    at = heard["GLOBAL_POSITION_INT"]
    north_deg, east_deg = PLANE.geodetic(2.5, 0.0)
    assert (at.lat, at.lon) == (round(1e7 * north_deg), round(1e7 * east_deg))
    assert (at.alt, at.relative_alt) == (300_000, 200_000)
    assert (at.vx, at.vy, at.vz, at.hdg) == (0, 2500, -50, 9000)
    assert at.time_boot_ms == 100
    assert heard["ATTITUDE"].roll == pytest.approx(0.1)
    assert heard["ATTITUDE"].yaw == pytest.approx(math.pi / 2.0, abs=1e-4)
    assert (heard["VFR_HUD"].airspeed, heard["VFR_HUD"].throttle) == (24.0, 40)
    assert heard["GPS_RAW_INT"].fix_type == 3
    assert heard["HOME_POSITION"].altitude == 100_000
    assert (heard["MISSION_CURRENT"].seq, heard["MISSION_CURRENT"].total) == (1, 2)
    assert heard["STATUSTEXT"].text == "plan 0: a way was found"


def test_no_word_of_an_event_is_cut_and_what_should_not_happen_warns(
    station: GroundStation, link: GroundStationLink
) -> None:
    station.listen()
    long = "collision: the left wing touched obstacle 12, " + "a house of the old town, " * 5
    for text in ("ring", Caution("no fix any more: the believed position drifts"), Caution(long), long, ""):
        link.on_event(1.0, text)
    link.close()
    time.sleep(0.05)
    told = [message for message in station.listen() if message.get_type() == "STATUSTEXT"]
    assert [(each.text, each.severity, each.id) for each in told[:2]] == [
        ("ring", 6, 0),
        ("no fix any more: the believed position drifts", 4, 0),
    ]
    for number, severity in ((1, 4), (2, 6)):
        pieces = [each for each in told if each.id == number]
        assert [each.chunk_seq for each in pieces] == list(range(4))
        assert {each.severity for each in pieces} == {severity}
        assert "".join(each.text.ljust(50) for each in pieces).rstrip() == long.rstrip()
    assert len(told) == 11


def test_in_an_outage_the_receiver_has_no_fix(
    station: GroundStation, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mavlink, "SLOW_S", 0.0)  # at every row
    scenario = world(
        TREE, navigation={"kind": "gnss", "outages_s": [[2.0, 4.0]]}, mission={"time_limit_s": 6.0}
    )
    fly_watched(
        scenario, tmp_path / "run", recording=False, onlookers=Onlookers(ground_station=station.address)
    )
    time.sleep(0.05)
    fixes = {
        round(each.time_usec / 1e6, 1): each.fix_type
        for each in station.listen()
        if each.get_type() == "GPS_RAW_INT"
    }
    assert len(fixes) > 20
    for time_s, fix in fixes.items():
        assert fix == (1 if 2.0 <= time_s < 4.0 else 3), time_s


def test_the_mission_is_given_item_by_item(station: GroundStation, link: GroundStationLink) -> None:
    station.listen()
    station.link.mav.mission_request_list_send(1, 1)
    (count,) = answers(station, link, "MISSION_COUNT")
    items = []
    for number in range(count.count):
        station.link.mav.mission_request_int_send(1, 1, number)
        items += answers(station, link, "MISSION_ITEM_INT")
    degrees = [PLANE.geodetic(east, 0.0) for east in (0.0, 300.0)]
    assert [(item.x, item.y) for item in items] == [(round(1e7 * a), round(1e7 * b)) for a, b in degrees]
    assert [(item.seq, item.current, item.command, item.z) for item in items] == [
        (0, 0, 16, 300.0),
        (1, 1, 16, 300.0),
    ]
    station.link.mav.mission_request_int_send(1, 1, 2)
    (refused,) = answers(station, link, "MISSION_ACK")
    assert refused.type == 13
    station.link.mav.mission_request_list_send(1, 1, 1)
    (fence,) = answers(station, link, "MISSION_COUNT")
    assert (fence.count, fence.mission_type) == (0, 1)


def test_a_mission_is_of_one_plan_though_another_comes_while_it_is_fetched(
    station: GroundStation, link: GroundStationLink, make_plan: MakePlan
) -> None:
    station.listen()
    northwards = make_plan([(0.0, 0.0, 0.0, 1.0, 0.0, 400.0), (0.0, 400.0, 0.0, 1.0, 0.0, 200.0)], index=1)
    fetched: list[list[tuple[int, int]]] = []
    for again in (False, True):
        items: list[Any] = []
        station.link.mav.mission_request_list_send(1, 1)
        (count,) = answers(station, link, "MISSION_COUNT")
        for number in range(count.count):
            station.link.mav.mission_request_int_send(1, 1, number)
            items += answers(station, link, "MISSION_ITEM_INT")
            if not again and number == 0:
                link.on_plan(northwards, state(0.2))
        fetched.append([(item.x, item.y) for item in items])
    east, north = (
        [PLANE.geodetic(*each) for each in ends] for ends in (((0, 0), (300, 0)), ((0, 0), (0, 400)))
    )
    assert fetched == [[(round(1e7 * a), round(1e7 * b)) for a, b in each] for each in (east, north)]


def test_what_is_meant_for_another_vehicle_is_not_answered(
    station: GroundStation, link: GroundStationLink
) -> None:
    station.listen()
    station.link.mav.mission_request_list_send(7, 1)
    assert answers(station, link, "MISSION_COUNT", wait_s=0.2) == []
    station.link.mav.mission_request_list_send(0, 0)
    assert len(answers(station, link, "MISSION_COUNT")) == 1


def test_nobody_can_command_or_change_the_flight(station: GroundStation, link: GroundStationLink) -> None:
    station.listen()
    mav = station.link.mav
    asked: tuple[tuple[Callable[[], Any], str, int], ...] = (
        (lambda: mav.mission_count_send(1, 1, 3), "MISSION_ACK", 14),
        (lambda: mav.mission_clear_all_send(1, 1), "MISSION_ACK", 14),
        (lambda: mav.command_long_send(1, 1, 400, 0, 0, 0, 0, 0, 0, 0, 0), "COMMAND_ACK", 3),
        (lambda: mav.command_long_send(1, 1, 512, 0, math.nan, 0, 0, 0, 0, 0, 0), "COMMAND_ACK", 3),
    )
    for ask, answer, result in asked:
        ask()
        (told,) = answers(station, link, answer)
        assert getattr(told, "type" if answer == "MISSION_ACK" else "result") == result
    mav.command_long_send(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)
    assert len(answers(station, link, "AUTOPILOT_VERSION")) == 1
    mav.param_request_list_send(1, 1)
    (parameter,) = answers(station, link, "PARAM_VALUE")
    assert (parameter.param_count, parameter.param_value) == (1, 1.0)


def test_each_question_of_a_station_that_starts_up_has_its_answer(
    station: GroundStation, link: GroundStationLink
) -> None:
    station.listen()
    mav = station.link.mav

    def command(number: int, first: float = 0.0) -> None:
        mav.command_long_send(1, 1, number, 0, first, 0, 0, 0, 0, 0, 0)

    asked: tuple[tuple[Callable[[], Any], str, dict[str, int]], ...] = (
        (lambda: command(520, 1), "AUTOPILOT_VERSION", {"capabilities": 8196}),
        (lambda: command(410), "HOME_POSITION", {"altitude": 100_000}),
        (lambda: command(512, 242), "HOME_POSITION", {"altitude": 100_000}),
        (lambda: command(512, 33), "GLOBAL_POSITION_INT", {"relative_alt": 200_000}),
        (lambda: command(512, 245), "EXTENDED_SYS_STATE", {"landed_state": 2}),
        (lambda: command(512, 0), "HEARTBEAT", {"system_status": 4}),
        (lambda: command(512, 42), "MISSION_CURRENT", {"seq": 1, "total": 2}),
        (lambda: command(512, 435), "COMMAND_ACK", {"command": 512, "result": 3}),  # AVAILABLE_MODES: none
        (lambda: command(512, 397), "COMMAND_ACK", {"command": 512, "result": 3}),  # COMPONENT_METADATA: none
        (lambda: command(511, 33), "COMMAND_ACK", {"command": 511, "result": 3}),
        (lambda: mav.set_mode_send(1, 1, 0), "COMMAND_ACK", {"command": 11, "result": 3}),
        (lambda: mav.mission_request_list_send(1, 1, 2), "MISSION_COUNT", {"count": 0, "mission_type": 2}),
        (lambda: mav.mission_set_current_send(1, 1, 0), "MISSION_CURRENT", {"seq": 1}),
        (lambda: mav.mission_write_partial_list_send(1, 1, 0, 1), "MISSION_ACK", {"type": 14}),
        (lambda: mav.mission_request_partial_list_send(1, 1, 0, 1, 1), "MISSION_ACK", {"mission_type": 1}),
        (lambda: mav.ping_send(77, 5, 0, 0), "PING", {"time_usec": 77, "seq": 5, "target_system": 255}),
        (lambda: mav.timesync_send(0, 12345), "TIMESYNC", {"ts1": 12345}),
    )
    for ask, kind, wanted in asked:
        ask()
        told = answers(station, link, kind)
        assert {name: getattr(told[0], name) for name in wanted} == wanted, kind
    heard = Counter(message.get_type() for message in station.heard)
    assert heard["EXTENDED_SYS_STATE"] > heard["SYS_STATUS"] - 1, "they were not waited for"


def test_no_message_of_the_dialect_ends_the_flight(station: GroundStation, link: GroundStationLink) -> None:
    from pymavlink.dialects.v20 import common

    station.listen()
    sender = common.MAVLink(None, 255, 0)
    for row, kind in enumerate(common.mavlink_map.values()):
        lengths = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
        for largest in (False, True):
            fields = (
                1
                if name in ("target_system", "target_component")
                else _value(of_type, lengths[name], largest)
                for name, of_type in zip(kind.fieldnames, kind.fieldtypes, strict=True)
            )
            station.link.port.sendto(kind(*fields).pack(sender), station.vehicle)
            link.on_row(state(1.0 + row + 0.5 * largest), STEERED, 0)
        station.listen()
    station.link.mav.mission_request_list_send(1, 1)
    assert len(answers(station, link, "MISSION_COUNT")) == 1


def _value(of_type: str, length: int, largest: bool) -> Any:
    """The least or the largest value of a field."""
    if of_type == "char":
        return (b"\xff" if largest else b"\x00") * max(length, 1)
    if of_type in ("float", "double"):
        value: float = math.nan if largest else -math.inf
    else:
        bits = int("".join(filter(str.isdigit, of_type)))
        value = 2 ** (bits - (not of_type.startswith("u"))) - 1 if largest else 0
    return [value] * length if length else value


def test_what_is_no_mavlink_is_passed_over(station: GroundStation, link: GroundStationLink) -> None:
    station.listen()
    for data in (b"", b"\x00" * 300, b"\xfd\x09" + b"\xff" * 40, bytes(range(256)) * 4):
        station.link.port.sendto(data, station.vehicle)
    station.link.mav.mission_request_list_send(1, 1)
    assert len(answers(station, link, "MISSION_COUNT")) == 1


def test_a_stranger_is_not_answered(station: GroundStation, link: GroundStationLink) -> None:
    station.listen()
    from pymavlink.dialects.v20 import common

    packed = common.MAVLink(None, 255, 0).mission_request_list_encode(1, 1).pack(common.MAVLink(None, 255, 0))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.sendto(packed, station.vehicle)
        assert answers(station, link, "MISSION_COUNT", wait_s=0.2) == []


def answers(station: GroundStation, link: GroundStationLink, kind: str, wait_s: float = 5.0) -> list[Any]:
    """What the vehicle answers of a kind, asked at each of its rows."""
    found: list[Any] = []
    until = time.monotonic() + wait_s
    row = 1
    while not found and time.monotonic() < until:
        row += 1
        link.on_row(state(row / 10.0), STEERED, 0)
        time.sleep(0.005)
        found = [message for message in station.listen() if message.get_type() == kind]
    return found


def test_nobody_listens_and_the_flight_goes_on(station: GroundStation) -> None:
    station.close()
    link = GroundStationLink(station.address)
    for row in range(20):
        link.on_row(state(row / 10.0), NOT_STEERED, -1)
    link.close()


def test_a_model_without_an_engine_is_told(station: GroundStation) -> None:
    link = GroundStationLink(station.address)
    link.on_row(state(0.0, throttle=math.nan), NOT_STEERED, -1)
    link.close()
    time.sleep(0.05)
    heard = [message.get_type() for message in station.listen()]
    assert "VFR_HUD" in heard
    assert "MISSION_CURRENT" not in heard


class Listens(Onlooker):
    """Lets the ground station hear while the flight is flown in this thread."""

    def __init__(self, station: GroundStation) -> None:
        self._station = station

    def on_row(self, state: AircraftState, *others: Any) -> None:
        self._station.listen()


@pytest.mark.flights
def test_a_whole_flight_is_shown_and_stays_the_same(station: GroundStation) -> None:
    scenario = world(TREE, mission={"goal_m": [2700.0, 2700.0]})
    alone = fly(make_loop(scenario, PointMass))
    link = GroundStationLink(station.address)
    link.begin(EarthPosition(PLANE, (300.0, 300.0)))
    watched = fly(make_loop(scenario, PointMass), [link, Listens(station), Pace(40.0)])
    link.close()
    time.sleep(0.05)
    station.listen()
    assert digest(watched.track) == digest(alone.track)
    kinds = Counter(message.get_type() for message in station.heard)
    assert kinds["GLOBAL_POSITION_INT"] >= 10
    assert kinds["HEARTBEAT"] >= 3
    beats = [message.system_status for message in station.heard if message.get_type() == "HEARTBEAT"]
    assert set(beats[:-1]) == {4}
    assert beats[-1] == 3
    last = [message for message in station.heard if message.get_type() == "GLOBAL_POSITION_INT"][-1]
    east, north = PLANE.plane(last.lat / 1e7, last.lon / 1e7)
    row = int(np.argmin(np.abs(watched.track.time_s - last.time_boot_ms / 1e3)))
    assert (east, north) == pytest.approx((watched.track.east_m[row], watched.track.north_m[row]), abs=0.1)
    texts = [message.text for message in station.heard if message.get_type() == "STATUSTEXT"]
    assert texts[-1].startswith("reached: ")


@pytest.mark.flights
def test_fly_is_paced_at_real_time_or_faster(
    station: GroundStation, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    to = f"udp:127.0.0.1:{station.port}"
    limited = ["--set", "mission.time_limit_s=3", "--no-recording", "--out"]
    begun_s = time.monotonic()
    assert main(["fly", "aerosonde_forest", "--mavlink", to, *limited, str(tmp_path / "run")]) == 1
    assert time.monotonic() - begun_s >= 3.0
    said = capsys.readouterr().err
    assert "area.origin is the default: the ground station shows the flight about 47, 8" in said
    assert {"HEARTBEAT", "GLOBAL_POSITION_INT"} <= {message.get_type() for message in station.listen()}


def test_the_current_item_is_the_next_along_the_path(make_plan: MakePlan) -> None:
    circle = (0.0, 0.0, 1.0, 0.0, 0.01, 200.0 * math.pi)
    there_and_back = make_plan(
        [(-300.0, 0.0, 1.0, 0.0, 0.0, 300.0), circle, (0.0, 0.0, 1.0, 0.0, 0.0, 300.0)]
    )
    mission = PlanAsMission.of(there_and_back, PLANE)
    assert mission.along_m.tolist() == pytest.approx([0.0, 300.0, 300.0], abs=1.0)
    assert [mission.current(along) for along in (0.0, 299.0, 301.0, 2000.0)] == [1, 1, 2, 2]


def test_rates_are_those_about_the_aircrafts_axes() -> None:
    before = state(0.0, roll_rad=0.0, pitch_rad=0.0, heading_rad=math.tau - 0.01)
    rolled = state(0.1, roll_rad=0.02, pitch_rad=0.0, heading_rad=math.tau - 0.01)
    assert body_rates_radps(before, rolled) == pytest.approx((0.2, 0.0, 0.0))
    turned = state(0.1, roll_rad=0.0, pitch_rad=0.0, heading_rad=0.01)
    assert body_rates_radps(before, turned) == pytest.approx((0.0, 0.0, 0.2))
    banked = state(0.1, roll_rad=0.5, pitch_rad=0.0, heading_rad=0.01)
    assert body_rates_radps(before, banked)[1] == pytest.approx(0.2 * math.sin(0.5))
    assert body_rates_radps(before, before) == (0.0, 0.0, 0.0)


def test_without_pymavlink_it_is_told_what_to_install(tmp_path: Path) -> None:
    code = """
import sys
sys.modules["pymavlink.dialects.v20"] = None
from harness.cli.app import main
sys.exit(main())
"""
    run = subprocess.run(
        [
            sys.executable,
            "-c",
            code,
            "fly",
            "aerosonde_forest",
            "--mavlink",
            "udp:127.0.0.1:9",
            "--out",
            "run",
        ],
        cwd=tmp_path,
        env={"PYTHONPATH": str(Path(__file__).parents[3]), "PATH": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 2
    assert "pip install 'wayproof[mavlink]'" in run.stderr
    assert list(tmp_path.iterdir()) == []
