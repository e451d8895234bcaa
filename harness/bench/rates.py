"""What the step rate of the flight model changes: the same flight at several rates, held against the finest.

Two flights, in still air: a minute and more of roll commands that come by the clock, which nothing corrects, and a
course of 14 turns under the guidance law, which corrects what the rate changes.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from aircraft.airframe import Airframe
from aircraft.airframes import AircraftError, airframe
from aircraft.envelope import performance
from aircraft.frames import LocalPlane
from aircraft.guidance.interface import UPDATE_RATE_HZ
from aircraft.guidance.registry import DEFAULT_KIND, guidance_kinds
from aircraft.interface import AircraftState, FloatArray
from aircraft.jsbsim_model import JsbsimModel
from aircraft.start import StartConditions
from harness.bench.tracking import ALTITUDE_M, COURSE_RAD, course

RATES_HZ: Final = (40, 60, 120, 240, 480)
"""The last is what the others are held against."""
OPEN_LOOP_S: Final = 120.0
REVERSED_EVERY_S: Final = 5.0
ROLL_DEG: Final = 25.0

Command = Callable[[AircraftState], float | None]
"""The roll command (rad) for a state; None ends the flight."""


def bench_rates(
    name: str, seeds: int, progress: Callable[[int, int, str], None] | None = None
) -> dict[str, Any]:
    """Flies both loops at every rate.

    Args:
        name: an aircraft.
        seeds: courses of the closed loop, of seeds 1, 2 and so on.
        progress: told what is done, of how much, and what is at hand.

    Returns:
        `aircraft`, `airspeed_mps`, `seeds`, `finest_hz`, and `rates`, one entry a rate: `rate_hz`; of `open_loop` and
        `closed_loop` (the worst of its courses) each `track_m`, the largest distance across the finest rate's track,
        and `position_m`, the largest at the same time; `cpu_ms`, processor time for a simulated second of both.

    Raises:
        AircraftError: the aircraft cannot be flown, or control is lost on the way.
    """
    frame = airframe(name)
    finest = _flights(frame, RATES_HZ[-1], seeds)[0]
    rows = []
    for done, rate_hz in enumerate(RATES_HZ):
        if progress is not None:
            progress(done, len(RATES_HZ), f"{rate_hz} Hz")
        tracks, cpu_ms = _flights(frame, rate_hz, seeds)
        off = [_off_m(track, fine) for track, fine in zip(tracks, finest, strict=True)]
        rows.append(
            {
                "rate_hz": rate_hz,
                "open_loop": _figures(off[:1]),
                "closed_loop": _figures(off[1:]),
                "cpu_ms": cpu_ms,
            }
        )
    return {
        "aircraft": name,
        "airspeed_mps": frame.cruise_mps,
        "seeds": seeds,
        "finest_hz": RATES_HZ[-1],
        "rates": rows,
    }


def open_loop(state: AircraftState) -> float | None:
    """Bank to one side and the other, by the clock."""
    if state.time_s >= OPEN_LOOP_S:
        return None
    return math.radians(ROLL_DEG if state.time_s // REVERSED_EVERY_S % 2 else -ROLL_DEG)


def _flights(frame: Airframe, rate_hz: int, seeds: int) -> tuple[list[FloatArray], float]:
    """The tracks of all flights at a rate, and the processor time (ms) for a simulated second."""
    begun = time.process_time()
    tracks = [_track(frame, rate_hz, open_loop)]
    tracks += [_track(frame, rate_hz, _closed_loop(frame, seed)) for seed in range(1, seeds + 1)]
    cpu_s = time.process_time() - begun
    return tracks, 1e3 * cpu_s * UPDATE_RATE_HZ / sum(map(len, tracks))


def _closed_loop(frame: Airframe, seed: int) -> Command:
    """Follows a course to its end."""
    law = guidance_kinds()[DEFAULT_KIND].law(frame.guidance_limits())
    law.follow(course(seed, performance(frame, frame.cruise_mps).turn_radius_m))

    def command(state: AircraftState) -> float | None:
        output = law.update(state)
        return None if output.past_end else output.roll_command_rad

    return command


def _track(frame: Airframe, rate_hz: int, command: Command) -> FloatArray:
    """Positions (m) and velocities (m/s), east and north, at every roll command: one row each."""
    speed = frame.cruise_mps
    start = StartConditions(0.0, 0.0, ALTITUDE_M, COURSE_RAD, speed)
    model = JsbsimModel(frame, start, LocalPlane(47.0, 8.0), step_rate_hz=rate_hz)
    rows = []
    while (roll_rad := command(state := model.state())) is not None:
        if fault := model.fault():
            raise AircraftError(
                f"{frame.name} at {rate_hz} Hz: control is lost after {state.time_s:.0f} s: {fault}"
            )
        rows.append((state.east_m, state.north_m, state.velocity_east_mps, state.velocity_north_mps))
        model.command(roll_rad, ALTITUDE_M, speed)
        model.advance(rate_hz // UPDATE_RATE_HZ)
    return np.array(rows)


def _off_m(track: FloatArray, fine: FloatArray) -> tuple[float, float]:
    """Largest distance (m) across another track, and at the same time."""
    both = min(len(track), len(fine))
    east, north = (track[:both, :2] - fine[:both, :2]).T
    along_east, along_north = (fine[:both, 2:] / np.hypot(*fine[:both, 2:].T)[:, None]).T
    across = np.abs(east * along_north - north * along_east)
    return float(across.max()), float(np.hypot(east, north).max())


def _figures(off_m: Sequence[tuple[float, float]]) -> dict[str, float]:
    """The worst of some flights."""
    across, at_once = (max(each) for each in zip(*off_m, strict=True))
    return {"track_m": across, "position_m": at_once}
