"""A flight as a MAVLink vehicle, so that a ground station such as QGroundControl shows it while it is flown.

Messages are those of MAVLink's common dialect, https://mavlink.io/en/messages/common.html, and its mission protocol,
https://mavlink.io/en/services/mission.html, of which a ground station may read the plan in effect and nothing else:
whatever it commands is refused. Datagrams go to one address, and only those that come from there are read.
"""

from __future__ import annotations

import contextlib
import math
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from aircraft.frames import LocalPlane
from aircraft.guidance.interface import GuidanceOutput
from aircraft.interface import AircraftState
from harness.files.input_file import InputError
from harness.flight.observer import Caution
from harness.flight.record import AcceptedPlan
from harness.watching.address import Address
from harness.watching.body_rates import body_rates_radps
from harness.watching.mavlink_mission import PlanAsMission
from harness.watching.onlooker import Onlooker
from harness.watching.pace import next_due

NEEDS_PYMAVLINK: Final = "wayproof: --mavlink needs pymavlink; pip install 'wayproof[mavlink]'"
SYSTEM_ID: Final = 1
FAST_S: Final = 0.1
"""Wall time from one attitude and position to the next."""
SLOW_S: Final = 1.0
"""Wall time from one heartbeat to the next, as ground stations expect them."""
MOST_DATAGRAMS: Final = 32
"""Of a ground station's that are read at a time."""
TEXT_BYTES: Final = 50
"""What a STATUSTEXT holds."""

_NOWHERE: Final = AircraftState(math.inf, *[0.0] * 11)


@dataclass(frozen=True)
class EarthPosition:
    """Where the flight is on earth.

    Attributes:
        plane: the local plane.
        home_m: east and north of the start.
        ground_m: altitude of home above mean sea level, from which relative altitudes count.
    """

    plane: LocalPlane
    home_m: tuple[float, float]
    ground_m: float = 0.0


class GroundStationLink(Onlooker):
    """Sends heartbeat, position, attitude, speed, mission and current item to a ground station, and answers it.

    Times in messages are simulated. `begin` comes first, `close` must be called.

    Args:
        to: where the ground station listens.

    Raises:
        InputError: pymavlink is not installed, or nothing can be sent there.
    """

    def __init__(self, to: Address) -> None:
        try:
            from pymavlink.dialects.v20 import common
        except ImportError as error:
            raise InputError(NEEDS_PYMAVLINK) from error
        self._m: Any = common
        self._mav: Any = common.MAVLink(None, srcSystem=SYSTEM_ID, srcComponent=1)
        self._place = EarthPosition(LocalPlane(0.0, 0.0), (0.0, 0.0))
        self._has_fix: Callable[[], bool] = lambda: True
        try:
            family, kind, *_, target = socket.getaddrinfo(to.host, to.port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(family, kind)
            self._socket.setblocking(False)
            self._socket.connect(target)
        except OSError as error:
            raise InputError(f"wayproof: nothing can be sent to {to.text} ({error.strerror})") from error
        self._mission: PlanAsMission | None = None
        self._asked_for: PlanAsMission | None = None
        """What the ground station fetches: the mission when it asked for the count, whatever plan comes meanwhile."""
        self._current, self._last = 0, _NOWHERE
        self._rates_radps = (0.0, 0.0, 0.0)
        self._fast_s = self._slow_s = -math.inf
        self._over = False
        self._long_texts = 0

    def begin(self, place: EarthPosition, has_fix: Callable[[], bool] = lambda: True) -> None:
        """Takes where the flight is on earth, and what tells whether its navigation has a fix."""
        self._place, self._has_fix = place, has_fix

    def on_plan(self, accepted: AcceptedPlan, state: AircraftState) -> None:
        """The plan in effect becomes the mission."""
        self._mission, self._current = PlanAsMission.of(accepted, self._place.plane), 0
        self._say(f"plan {accepted.plan_index}: {accepted.plan.reason}")

    def on_event(self, time_s: float, text: str) -> None:
        """Tells of an event."""
        self._say(text, warns=isinstance(text, Caution))

    def on_row(self, state: AircraftState, steering: GuidanceOutput, plan_index: int) -> None:
        """Sends what is due, and answers what has come."""
        self._rates_radps = body_rates_radps(self._last, state)
        self._last = state
        if self._mission is not None and math.isfinite(steering.arc_length_m):
            self._current = self._mission.current(steering.arc_length_m)
        self._answer()
        now = time.monotonic()
        if now >= self._slow_s:
            self._slow_s = next_due(self._slow_s, SLOW_S, now)
            self._send_slow(state)
        if now >= self._fast_s:
            self._fast_s = next_due(self._fast_s, FAST_S, now)
            self._send_fast(state)

    def close(self) -> None:
        """Says with a last heartbeat that the flight is over."""
        if not self._over:
            self._over = True
            self._heartbeat(self._m.MAV_STATE_STANDBY)
            self._socket.close()

    @property
    def _boot_ms(self) -> int:
        return round(1e3 * self._last.time_s) & 0xFFFFFFFF if self._last is not _NOWHERE else 0

    def _send(self, message: Any) -> None:
        with contextlib.suppress(OSError):  # nobody listens, or not now: it is no matter of the flight
            self._socket.send(message.pack(self._mav))
            self._mav.seq = (self._mav.seq + 1) % 256

    def _say(self, text: str, warns: bool = False) -> None:
        """Sends a text; a longer one in pieces, of which the station makes one again."""
        m, data = self._m, text.encode("ascii", "replace")
        severity = m.MAV_SEVERITY_WARNING if warns else m.MAV_SEVERITY_INFO
        number = 0
        if len(data) > TEXT_BYTES:
            number = self._long_texts = self._long_texts % 0xFFFF + 1
        for piece, first in enumerate(range(0, max(len(data), 1), TEXT_BYTES)):
            self._send(self._mav.statustext_encode(severity, data[first : first + TEXT_BYTES], number, piece))

    def _heartbeat(self, status: int) -> None:
        m = self._m
        mode = (
            m.MAV_MODE_FLAG_AUTO_ENABLED | m.MAV_MODE_FLAG_GUIDED_ENABLED | m.MAV_MODE_FLAG_STABILIZE_ENABLED
        )
        if status == m.MAV_STATE_ACTIVE:
            mode |= m.MAV_MODE_FLAG_SAFETY_ARMED
        self._send(
            self._mav.heartbeat_encode(m.MAV_TYPE_FIXED_WING, m.MAV_AUTOPILOT_GENERIC, mode, 0, status)
        )

    def _send_slow(self, state: AircraftState) -> None:
        self._heartbeat(self._m.MAV_STATE_ACTIVE)
        latitude, longitude = self._degrees(state.east_m, state.north_m)
        course = state.course_rad + self._convergence_rad(state)
        self._send(
            self._mav.gps_raw_int_encode(
                round(1e6 * state.time_s),
                self._m.GPS_FIX_TYPE_3D_FIX if self._has_fix() else self._m.GPS_FIX_TYPE_NO_FIX,
                latitude,
                longitude,
                round(1e3 * state.up_m),
                100,
                100,
                round(100.0 * state.groundspeed_mps),
                _centidegrees(course),
                255,
            )
        )
        self._send(self._mav.sys_status_encode(0, 0, 0, 0, 65535, -1, -1, 0, 0, 0, 0, 0, 0))
        self._send(self._mav.extended_sys_state_encode(0, self._m.MAV_LANDED_STATE_IN_AIR))
        self._send_home()
        self._send_current()

    def _send_fast(self, state: AircraftState) -> None:
        latitude, longitude = self._degrees(state.east_m, state.north_m)
        heading = state.heading_rad + self._convergence_rad(state)
        yaw = math.remainder(heading, math.tau)
        self._send(
            self._mav.attitude_encode(self._boot_ms, state.roll_rad, state.pitch_rad, yaw, *self._rates_radps)
        )
        self._send(
            self._mav.global_position_int_encode(
                self._boot_ms,
                latitude,
                longitude,
                round(1e3 * state.up_m),
                round(1e3 * (state.up_m - self._place.ground_m)),
                round(100.0 * state.velocity_north_mps),
                round(100.0 * state.velocity_east_mps),
                round(-100.0 * state.velocity_up_mps),
                _centidegrees(heading),
            )
        )
        heading_deg, throttle = round(math.degrees(heading)) % 360, state.throttle
        self._send(
            self._mav.vfr_hud_encode(
                state.airspeed_mps,
                state.groundspeed_mps,
                heading_deg,
                round(100.0 * min(max(throttle, 0.0), 1.0)) if math.isfinite(throttle) else 0,
                state.up_m,
                state.velocity_up_mps,
            )
        )

    def _send_home(self) -> None:
        latitude, longitude = self._degrees(*self._place.home_m)
        altitude = round(1e3 * self._place.ground_m)
        level = [1.0, 0.0, 0.0, 0.0]
        self._send(self._mav.home_position_encode(latitude, longitude, altitude, 0, 0, 0, level, 0, 0, 0))

    def _send_current(self) -> None:
        if self._mission is not None:
            active = self._m.MISSION_STATE_ACTIVE
            self._send(self._mav.mission_current_encode(self._current, len(self._mission), active, 1))

    def _degrees(self, east_m: float, north_m: float) -> tuple[int, int]:
        """Latitude and longitude in units of 1e-7 degrees."""
        latitude, longitude = self._place.plane.geodetic(east_m, north_m)
        return round(1e7 * latitude), round(1e7 * longitude)

    def _convergence_rad(self, state: AircraftState) -> float:
        """What a direction in the plane lacks of one from true north."""
        return self._place.plane.convergence_rad(state.east_m, state.north_m)

    def _answer(self) -> None:
        """Answers what a ground station asks for."""
        for _ in range(MOST_DATAGRAMS):
            try:
                data = self._socket.recv(65536)
            except OSError:  # nothing is there, or nobody listens
                return
            parser = self._m.MAVLink(None)  # anew: a message does not go on in the next datagram
            parser.robust_parsing = True
            for message in parser.parse_buffer(data) or ():
                if getattr(message, "target_system", SYSTEM_ID) not in (0, SYSTEM_ID):
                    continue
                answer = self._answers.get(message.get_type())
                if answer is not None:
                    answer(self, message)

    def _give_count(self, asked: Any) -> None:
        flown = asked.mission_type == self._m.MAV_MISSION_TYPE_MISSION
        if flown:
            self._asked_for = self._mission
        count = len(self._asked_for) if flown and self._asked_for is not None else 0
        self._send(self._mav.mission_count_encode(*_sender(asked), count, asked.mission_type))

    def _give_item(self, asked: Any) -> None:
        m, mission = self._m, self._asked_for or self._mission
        there = asked.mission_type == m.MAV_MISSION_TYPE_MISSION and mission is not None
        if mission is None or not there or not 0 <= asked.seq < len(mission):
            self._send(
                self._mav.mission_ack_encode(
                    *_sender(asked), m.MAV_MISSION_INVALID_SEQUENCE, asked.mission_type
                )
            )
            return
        latitude, longitude = mission.degrees[asked.seq].tolist()
        whole = asked.get_type() == "MISSION_REQUEST_INT"
        encode = self._mav.mission_item_int_encode if whole else self._mav.mission_item_encode
        self._send(
            encode(
                *_sender(asked),
                asked.seq,
                m.MAV_FRAME_GLOBAL,
                m.MAV_CMD_NAV_WAYPOINT,
                int(mission is self._mission and asked.seq == self._current),
                1,
                0.0,
                0.0,
                0.0,
                math.nan,
                round(1e7 * latitude) if whole else latitude,
                round(1e7 * longitude) if whole else longitude,
                self._last.up_m,
                m.MAV_MISSION_TYPE_MISSION,
            )
        )

    def _refuse_mission(self, asked: Any) -> None:
        kind = getattr(asked, "mission_type", 0)
        self._send(self._mav.mission_ack_encode(*_sender(asked), self._m.MAV_MISSION_DENIED, kind))

    def _give_parameter(self, asked: Any) -> None:
        """The only parameter: stations wait for a whole set of them before they show a vehicle."""
        real = self._m.MAV_PARAM_TYPE_REAL32
        self._send(self._mav.param_value_encode(b"SYSID_THISMAV", float(SYSTEM_ID), real, 1, 0))

    def _obey(self, asked: Any) -> None:
        """Sends a message that is asked for; refuses any other command."""
        m = self._m
        wanted = int(asked.param1) if math.isfinite(asked.param1) else -1
        if asked.command == m.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES:
            wanted = m.MAVLINK_MSG_ID_AUTOPILOT_VERSION
        elif asked.command == m.MAV_CMD_GET_HOME_POSITION:
            wanted = m.MAVLINK_MSG_ID_HOME_POSITION
        elif asked.command != m.MAV_CMD_REQUEST_MESSAGE:
            wanted = -1
        send = self._given_by(wanted)
        result = m.MAV_RESULT_UNSUPPORTED if send is None else m.MAV_RESULT_ACCEPTED
        self._send(self._mav.command_ack_encode(asked.command, result, 0, 0, *_sender(asked)))
        if send is not None:
            send()

    def _given_by(self, message: int) -> Callable[[], None] | None:
        """What sends a message of a number; None for those that are never sent."""
        m = self._m
        if message == m.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
            return self._send_version
        if message == m.MAVLINK_MSG_ID_HOME_POSITION:
            return self._send_home
        if message == m.MAVLINK_MSG_ID_HEARTBEAT:
            return lambda: self._heartbeat(m.MAV_STATE_ACTIVE)
        if message == m.MAVLINK_MSG_ID_MISSION_CURRENT:
            return self._send_current
        fast = (m.MAVLINK_MSG_ID_ATTITUDE, m.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, m.MAVLINK_MSG_ID_VFR_HUD)
        if message in fast:
            return lambda: self._send_fast(self._last)
        slow = (
            m.MAVLINK_MSG_ID_GPS_RAW_INT,
            m.MAVLINK_MSG_ID_SYS_STATUS,
            m.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
        )
        return (lambda: self._send_slow(self._last)) if message in slow else None

    def _send_version(self) -> None:
        able = self._m.MAV_PROTOCOL_CAPABILITY_MAVLINK2 | self._m.MAV_PROTOCOL_CAPABILITY_MISSION_INT
        zeros = [0] * 8
        self._send(self._mav.autopilot_version_encode(able, 0, 0, 0, 0, zeros, zeros, zeros, 0, 0, 0))

    def _refuse_mode(self, asked: Any) -> None:
        unsupported = self._m.MAV_RESULT_UNSUPPORTED
        self._send(
            self._mav.command_ack_encode(self._m.MAVLINK_MSG_ID_SET_MODE, unsupported, 0, 0, *_sender(asked))
        )

    def _keep_current(self, asked: Any) -> None:
        """The current item is told as it is: a station cannot set it."""
        self._send_current()

    def _echo(self, asked: Any) -> None:
        if asked.target_system == 0:  # else it is an answer itself
            self._send(self._mav.ping_encode(asked.time_usec, asked.seq, *_sender(asked)))

    def _give_time(self, asked: Any) -> None:
        if asked.tc1 == 0:  # else it is an answer itself
            self._send(self._mav.timesync_encode(1_000_000 * self._boot_ms, asked.ts1))

    _answers: Final[dict[str, Callable[[GroundStationLink, Any], None]]] = {
        "MISSION_REQUEST_LIST": _give_count,
        "MISSION_REQUEST_INT": _give_item,
        "MISSION_REQUEST": _give_item,
        "MISSION_COUNT": _refuse_mission,
        "MISSION_CLEAR_ALL": _refuse_mission,
        "MISSION_WRITE_PARTIAL_LIST": _refuse_mission,
        "MISSION_REQUEST_PARTIAL_LIST": _refuse_mission,
        "MISSION_SET_CURRENT": _keep_current,
        "SET_MODE": _refuse_mode,
        "PING": _echo,
        "TIMESYNC": _give_time,
        "PARAM_REQUEST_LIST": _give_parameter,
        "PARAM_REQUEST_READ": _give_parameter,
        "PARAM_SET": _give_parameter,
        "COMMAND_LONG": _obey,
        "COMMAND_INT": _obey,
    }


def _sender(message: Any) -> tuple[int, int]:
    """To whom an answer goes."""
    return message.get_srcSystem(), message.get_srcComponent()


def _centidegrees(angle_rad: float) -> int:
    """A direction in [0, 36000)."""
    return round(100.0 * math.degrees(angle_rad)) % 36000
