"""One run of a campaign again, from its results alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from harness.campaign.campaign_file import CampaignFile
from harness.campaign.results import campaign_of, row_of
from harness.campaign.runs import CampaignRuns
from harness.files.strict_yaml import InputError
from harness.scenario.scenario import Scenario


def flown_run(
    results: Path, run: int, overrides: Sequence[tuple[str, str]] = ()
) -> tuple[Scenario, str | None]:
    """What a run of a campaign flew, and the digest of its row.

    Args:
        results: a campaign's `results.parquet`; it holds the campaign, no other file is needed.
        run: number of the run; it may still be missing in the table.
        overrides: keys to replace besides, as `load_scenario` takes them.

    Raises:
        InputError: the file is something else, or the campaign has no such run.
    """
    runs = CampaignRuns(CampaignFile.from_plain(campaign_of(results), str(results)))
    if not 0 <= run < len(runs):
        raise InputError(f"{results}: has no run {run}; must be 0 to {len(runs) - 1}")
    row = row_of(results, run)
    return runs.scenario(run, overrides), row["digest"] if row else None
