"""A recording as a path, and as a table of its data."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.files.input_file import InputError

if TYPE_CHECKING:
    import pyarrow as pa

_PATH: Any = type(Path())


class Recording(_PATH):  # type: ignore[misc]
    """The file of a recording for rerun, `flight.rrd`."""

    def dataframe(
        self,
        contents: str | Sequence[str] = "/series/**",
        index: str = "sim_time",
        *,
        filled: bool = False,
    ) -> pa.Table:
        """The recorded data of some entities, a row for each time of a timeline.

            run.recording.dataframe("/series/clearance/**").to_pandas()

        Args:
            contents: paths of entities as rerun writes them: `/series/**`; `-/series/bank/**` leaves some out.
            index: the timeline.
            filled: an empty cell gets the last value before it.

        Returns:
            Columns `recording`, its identity; `sim_time_s`; one for each entity: its number, or a list of values.

        Raises:
            InputError: nothing was recorded there, or the extra `wayproof[catalog]` is not installed.
        """
        return recorded([self], contents, index, filled)


def recorded(files: Sequence[Path], contents: str | Sequence[str], index: str, filled: bool) -> pa.Table:
    """The same of several recordings, one below the other.

    Raises:
        InputError: nothing was recorded there, or the extra `wayproof[catalog]` is not installed.
    """
    from harness.recording.catalog import series_table
    from harness.recording.viewer import ViewerError

    try:
        return series_table([Path(file) for file in files], contents, index, filled)
    except (ViewerError, ValueError) as error:
        raise InputError(f"wayproof: {error}") from error
