import pytest
import rerun as rr


@pytest.fixture(autouse=True)
def strict(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bad data is an error, not a warning."""
    monkeypatch.setattr(rr.error_utils, "_strict_mode", True)
