"""npfg and L1 against what the original sources gave at single states, their memory included.

The data (shared/guidance/README.md) are not part of wayproof.
"""

from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from aircraft.guidance.l1 import L1Circle, L1Config, L1Memory, L1Motion, follow_circle, follow_leg
from aircraft.guidance.npfg import NpfgConfig, NpfgInput, npfg

Row = dict[str, Any]
"""Column names and values: numbers, but for the kind of a run."""

REFERENCE = Path(__file__).parents[2].parent / "shared" / "guidance"
TOLERANCE = 1e-6  # of a difference over 1 + |reference|
EVERY = 12


def npfg_input(*values: float) -> NpfgInput:
    """From east and north of five vectors, and the curvature."""
    every: Any = (*map(complex, values[:10:2], values[1:10:2]), values[10])
    return NpfgInput(*every)


def npfg_columns(row: Row) -> Row:
    """What the law gives for a row of `npfg_states`."""
    at = "pos_e pos_n vg_e vg_n w_e w_n path_e path_n t_e t_n kappa"
    keys = (
        "p_period p_damping p_en_period_lb p_en_period_ub p_en_min_gsp p_en_track_keep p_en_wind_reg p_min_gsp "
        "p_gsp_max_tk p_roll_tc p_sw_mult p_period_sf"
    )
    has = NpfgConfig(*(bool(row[key]) if "_en_" in key else row[key] for key in keys.split()))
    output = npfg(npfg_input(*(row[name] for name in at.split())), has, row["p_va_nom"], row["p_va_max"])
    return dict(zip(("lat_acc", "airspeed_ref"), output, strict=True))


def motion_of(row: Row) -> L1Motion:
    place, velocity = complex(row["pos_e"], row["pos_n"]), complex(row["vg_e"], row["vg_n"])
    return L1Motion(place, velocity, row["yaw"], int(row["yaw_cd"]))


def leg_columns(row: Row) -> Row:
    """What the law gives for a row of `l1_waypoint_states`."""
    begin, end = (complex(row[f"{name}_e"], row[f"{name}_n"]) for name in ("prev", "next"))
    before = L1Memory(*(row[name] for name in ["last_nu_in", "xtrack_i_in", "gain_prev_in"]))
    has = L1Config(row["p_period"], row["p_damping"], row["p_xtrack_i"])
    output, memory = follow_leg(motion_of(row), (begin, end), row["dt_us"] * 1e-6, before, has)
    return {"lat_acc": output, "xtrack_i_out": memory.integrator_rad, "last_nu_out": memory.last_nu_rad}


def circle_columns(row: Row) -> Row:
    """What the law gives for a row of `l1_loiter_states`, on a circle as large as that was flown."""
    circle = L1Circle(complex(row["centre_e"], row["centre_n"]), row["scaled_radius"], row["direction"])
    has = L1Config(row["p_period"], row["p_damping"], 0.0)
    output, memory = follow_circle(motion_of(row), circle, L1Memory(row["last_nu_in"]), has)
    return {"lat_acc": output, "last_nu_out": memory.last_nu_rad}


STATES: dict[str, Callable[[Row], Row]] = {
    "npfg_states": npfg_columns,
    "l1_waypoint_states": leg_columns,
    "l1_loiter_states": circle_columns,
}


needs_reference = pytest.mark.skipif(not REFERENCE.is_dir(), reason="no shared/guidance beside the checkout")


@needs_reference
@pytest.mark.parametrize("name", STATES)
def test_laws_decide_as_the_original_sources_do(name: str) -> None:
    """Without a least L1 distance, as in plain missions."""
    worst: dict[str, float] = defaultdict(float)
    for row in pq.read_table(REFERENCE / f"{name}.parquet").to_pylist()[::EVERY]:
        if row.get("ambiguous") or row.get("dist_min"):
            continue
        for column, value in STATES[name](row).items():
            worst[column] = max(worst[column], abs(value - row[column]) / (1.0 + abs(row[column])))
    assert len(worst) >= 2
    assert {column: far for column, far in worst.items() if not far <= TOLERANCE} == {}
