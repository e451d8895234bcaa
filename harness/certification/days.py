"""The days of a certificate: a campaign whose cases are draws of one scenario, or of one given path.

Day k has a seed of its own and a draw of every varied quantity, both from the root seed and k alone.
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from harness.analysis.claims import Claim
from harness.campaign.campaign_file import Base, Campaign, CampaignFile
from harness.campaign.flight import Job
from harness.campaign.runs import CampaignRuns
from harness.files.strict_yaml import COMMAND_LINE, InputError, node_of
from harness.run.path_check import PathCheck
from harness.scenario.scenario import Scenario
from harness.scenario.validation import KeyFaults

Settings = Sequence[tuple[str, str]]


class Days(CampaignRuns):
    """The days of a scenario."""

    def __init__(
        self,
        base: Base,
        vary: Mapping[str, Mapping[str, Any]],
        *,
        claim: Claim,
        seed: int,
        most: int,
        sources: tuple[tuple[str, ...], tuple[str, ...]] = ((), ()),
        band: bool = False,
    ) -> None:
        """Makes the days of a scenario; nothing is flown.

        Args:
            base: the scenario.
            vary: what is drawn by key path, as `random` of a campaign file.
            claim: what is claimed of each day.
            seed: root seed of all draws.
            most: number of days that may be flown.
            sources: planners and guidance laws, as `CampaignRuns` takes them.
            band: whether `band.json` is made of the tracks of all days.

        Raises:
            InputError: a key or a distribution is none.
        """
        self.band = band
        plain = {
            "schema": "wayproof/campaign/1",
            "name": base.name,
            "seed": seed,
            "scenarios": [base.file],
            "random": {key: dict(each) for key, each in vary.items()},
            "draws": most,
            "recordings": "all" if band else "failures",
            "optimum": False,
        }
        root = node_of(plain, COMMAND_LINE)
        try:
            campaign = Campaign.model_validate(plain)
        except ValidationError as error:
            raise KeyFaults.of(error, Campaign).in_file(root, "command line") from error
        super().__init__(CampaignFile(campaign, "command line", root, (base,)), *sources)
        self.claim: Claim = claim
        self.vary = vary

    def flown(self, number: int) -> Scenario:
        """The scenario of day `number`, complete."""
        return self.scenario(number)

    def job(self, number: int, folder: Path) -> Job:
        """Day `number` as it is handed to who flies it."""
        return replace(super().job(number, folder), claim=self.claim)

    def plain(self) -> dict[str, Any]:
        """All that says what is flown, and what is claimed."""
        return {**super().plain(), "claim": self.claim}


class PathDays(Days):
    """The days on which a given path is flown."""

    def __init__(
        self,
        ask: Callable[[Settings], PathCheck],
        content: str,
        command: Sequence[str],
        vary: Mapping[str, Mapping[str, Any]],
        **terms: Any,
    ) -> None:
        """Makes the days; nothing is flown.

        Args:
            ask: puts together what the path is flown with, some keys of its scenario replaced.
            content: all that the path consists of, as text; a change of it makes other days.
            command: words of the command that flies the path, without those that differ between days.
            vary: as `Days` takes it.
            terms: likewise.

        Raises:
            InputError: the path cannot be flown as asked, or a key or a distribution is none.
        """
        self._ask, self._command = ask, command
        self._digest = sha256(content.encode()).hexdigest()
        scenario = ask(()).scenario
        keys: dict[str, Any] = {
            "schema": "wayproof/scenario/1",
            "name": scenario.name,
            "aircraft": {"model": scenario.aircraft.model},
            "planner": {"kind": "given"},
        }
        super().__init__(Base(scenario.name, "command line", node_of(keys, COMMAND_LINE)), vary, **terms)

    def settings(self, number: int) -> list[tuple[str, str]]:
        """The keys that day `number` replaces, and their values as YAML."""
        day = self.run(number)
        return [("seed", str(day.seed)), *((key, json.dumps(value)) for key, value in day.varied.items())]

    def flown(self, number: int) -> Scenario:
        """The scenario of day `number`, complete."""
        return self.path(number).scenario

    def path(self, number: int) -> PathCheck:
        """What is flown on day `number`."""
        return self._ask(self.settings(number))

    def check(self, progress: Callable[[int], None] | None = None) -> None:
        """Puts together what is flown on every day.

        Raises:
            InputError: one cannot be flown.
        """
        for number in range(len(self)):
            try:
                self.path(number)
            except InputError as error:
                raise InputError(f"{error} (day {number})") from error
            if progress is not None:
                progress(number + 1)

    def packed(self, number: int) -> bytes:
        """Nothing: the scenario goes with the path."""
        return b""

    def job(self, number: int, folder: Path) -> Job:
        """Day `number` as it is handed to who flies it."""
        return replace(super().job(number, folder), path=self.path(number))

    def again(self, number: int, folder: Path) -> str:
        """The command that flies day `number` again."""
        words = [each for pair in self.settings(number) for each in ("--set", "=".join(pair))]
        return shlex.join([*self._command, *words])

    def plain(self) -> dict[str, Any]:
        """All that says what is flown, and what is claimed."""
        return {**super().plain(), "path": self._digest}
