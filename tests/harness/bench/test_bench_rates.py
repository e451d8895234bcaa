"""`wayproof bench rates`: what its figures are, and its table."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from harness.bench import rates
from harness.bench.tracking import course
from harness.cli.app import main


@pytest.fixture(scope="module")
def result() -> dict[str, Any]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rates, "RATES_HZ", (60, 120, 480))
        patch.setattr(rates, "OPEN_LOOP_S", 40.0)
        return rates.bench_rates("aerosonde", 1)


@pytest.mark.flights
def test_the_default_rate_is_as_true_as_it_is_said_to_be(result: dict[str, Any]) -> None:
    """Within 0.05 m of 480 steps a second on 14 turns."""
    coarse, middle, finest = result["rates"]
    assert [row["rate_hz"] for row in result["rates"]] == [60, 120, 480]
    assert finest["open_loop"] == finest["closed_loop"] == {"track_m": 0.0, "position_m": 0.0}
    assert 0.0 < middle["closed_loop"]["track_m"] < coarse["closed_loop"]["track_m"] < 0.05
    assert 0.0 < middle["open_loop"]["track_m"] < coarse["open_loop"]["track_m"] < 0.3
    for row in (coarse, middle):
        assert row["closed_loop"]["track_m"] <= row["closed_loop"]["position_m"]


def test_distance_across_a_track_and_at_the_same_time() -> None:
    fine = np.array([[0.0, 10.0 * i, 0.0, 25.0] for i in range(5)])
    moved = fine + np.array([0.3, -0.4, 0.0, 0.0])
    assert rates._off_m(moved[:4], fine) == pytest.approx((0.3, 0.5))


def test_prints_a_row_a_rate(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(rates, "RATES_HZ", (60, 120))
    monkeypatch.setattr(rates, "OPEN_LOOP_S", 5.0)
    monkeypatch.setattr(rates, "course", lambda seed, radius_m: course(seed, radius_m, 1))
    assert main(["bench", "rates", "--seeds", "1"]) == 0
    said = capsys.readouterr().out
    assert "from the flight at 120 Hz" in said
    assert [line.split()[0] for line in said.split("\n") if " Hz " in line][-2:] == ["60", "120"]
    assert main(["bench", "rates", "--seeds", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["finest_hz"] == 120
    assert main(["bench", "rates", "--aircraft", "kite"]) == 2
    assert "unknown aircraft 'kite'" in capsys.readouterr().err
