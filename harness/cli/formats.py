"""The commands about files that can be given: `validate`, `schema`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Literal

from harness.cli.command_line import BAD_INPUT, load, print_json
from harness.cli.options import argument
from harness.cli.standard_output import say
from harness.files.input_file import InputError


def validate(
    files: Annotated[list[str], argument("FILE...", "Scenario or campaign files, or shipped names.")],
) -> int:
    """Checks scenario and campaign files without flying them; in a campaign, every run.

    For example: wayproof validate my_world.yaml paper_circles
    """
    status = 0
    for file in files:
        try:
            found = _found(file)
        except InputError as error:
            say(str(error), err=True)
            status = BAD_INPUT
        else:
            say(f"{file}: {found[0]}: valid")
            for sentence in found[1]:
                say(f"  not covered by what the planner promises: {sentence}")
    return status


def _found(file: str) -> tuple[str, tuple[str, ...]]:
    """What a valid file holds, in a few words, and what of a scenario lies outside the planner's assumptions."""
    from harness.campaign.campaign_file import is_campaign
    from harness.files.wording import counted
    from harness.scenario.shipped import campaign_path, shipped_campaigns

    if file in shipped_campaigns() or (os.path.isfile(file) and is_campaign(Path(file))):
        from harness.cli.sweep import checked

        runs = checked(campaign_path(file))
        return f"{runs.campaign.name}, {counted(len(runs), 'run')} of {counted(runs.cases, 'case')}", ()
    loaded = load(file)
    from harness.world.motion_assumptions import outside_assumptions

    held = f"{loaded.name}, {counted(len(loaded.obstacles), 'obstacle')}"
    return held, outside_assumptions(loaded)


def schema(
    kind: Annotated[
        Literal["scenario", "campaign"], argument("FORMAT", "The file format.", show_default=True)
    ] = "scenario",
) -> int:
    """Prints the JSON Schema of a file format, for editors.

    For example: wayproof schema > scenario.schema.json
    """
    if kind == "campaign":
        from harness.campaign.campaign_file import campaign_schema

        print_json(campaign_schema())
    else:
        from harness.scenario.scenario import scenario_schema

        print_json(scenario_schema())
    return 0
