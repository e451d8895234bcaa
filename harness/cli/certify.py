"""The command `certify`: how often a claim holds, and how sure that is."""

from __future__ import annotations

import math
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from harness.analysis.metric import Claim
from harness.cli.command_line import FAILED, distinct_suffix, print_json, resumable
from harness.cli.options import Count, Json, Number, Out, Quiet, Resume, Text, Workers, argument, flag, option
from harness.cli.replacing import NOTHING, Given, replacing
from harness.cli.terminal import plain, print_table, say, say_view, step_bar
from harness.files.folder_lock import MAX_INDEX_BYTES
from harness.files.input_file import read_index

if TYPE_CHECKING:
    from harness.certification.certification import Certificate, DayCount, Terms
    from harness.certification.days import Days
    from harness.certification.rare import Rare
    from harness.run.path_check import CheckedFile

MOST_SHOWN: Final = 5  # the terminal shows at most so many ways to fail, and quantities; the file has all
LEAST_SHARE: Final = 0.01  # a quantity is printed if it explains at least this share of the failures
VERDICT_STYLE: Final = {"shown": "bold green", "refuted": "bold red", "undecided": "bold yellow"}
CLAIM_HELP: Final = "reached (default), no-contact, trackable; as-given (default of a path)."
PROBABILITY_HELP: Final = "Claim that it holds on this share of the days; stops once that is decided."
RARE_HELP: Final = "Subset simulation, for failures on less than one day in 1,000; not of reached."
VARY_HELP: Final = "LO:HI, MEAN~SIGMA or A,B,...: drawn anew every day; can be repeated."


@replacing("planner", "aircraft", "guidance", "conditions", "wind", "turbulence", "seed", "settings")
def certify(
    subject: Annotated[str, argument("SCENARIO|PATH", "A scenario, or a path that `wayproof check` takes.")],
    given: Given = NOTHING,
    claim: Annotated[Claim | None, option("CLAIM", CLAIM_HELP)] = None,
    probability: Annotated[Number, option("P", PROBABILITY_HELP)] = None,
    confidence: Annotated[float, option("C", "Of each bound.")] = 0.95,
    rare: Annotated[bool, flag("--rare", RARE_HELP)] = False,
    runs: Annotated[Count, option("N", "Days at most. Default: 1000, --rare 10000, at least 520.", min=1)] = None,
    vary: Annotated[list[str] | None, option("KEY=DRAW", VARY_HELP)] = None,
    world: Annotated[Text, option("WORLD", "Of a path: obstacles, bounds, air.", "--scenario")] = None,
    workers: Workers = None,
    out: Out = None,
    resume: Resume = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """Flies a scenario or a path on many days, and says how often a claim holds, with confidence bounds.

    Every day has its own seed and its own draw of what varies. Without --probability all N days are flown, and the
    bounds are those of Clopper and Pearson. With it the flights end as soon as the claim is shown or refuted; the
    bounds then hold at every look. With --rare the days are drawn ever nearer to failure, and the claim is looked at
    once, at the end.

    For example: wayproof certify aerosonde_forest --vary environment.wind.speed_mps=0:8 --probability 0.9

    Exit status:
    0 shown
    1 refuted or undecided
    2 bad input or usage, nothing flown
    """
    from harness.certification.certification import DEFAULT_RUNS, Terms
    from harness.certification.days import DEFAULT_AIRCRAFT, days_of, distributions, is_path
    from harness.scenario.shipped import scenario_path

    terms = Terms(probability, confidence)
    try:
        drawn = distributions(vary or ())
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--vary") from error
    given.check_beside(drawn)
    if is_path(subject) and "aircraft.model" not in dict(given.keys):
        say(f"no --aircraft: the path is flown by the {DEFAULT_AIRCRAFT}", err=True)
    place = None if world is None else scenario_path(world)
    purpose, ending = ("rare", "-rare") if rare else ("counted", "")
    terms_of_days = {"most": runs or DEFAULT_RUNS[purpose], "sources": given.sources, "purpose": purpose}
    days = days_of(subject, given.keys, drawn, claim, place, **terms_of_days)
    apart = distinct_suffix([*given.keys, *((key, str(each)) for key, each in drawn.items())], named=())
    folder = out or Path("runs") / days.campaign.name / f"certify-{days.claim}{ending}{apart}"
    found = _fly(days, folder, workers, terms, resume=resume, silent=quiet)
    if as_json:
        print_json(found.plain())
    elif not quiet:
        print_table(f"{found.subject}: {found.planner}, {found.aircraft}", certificate_rows(found))
        say(f"certificate: {folder / 'certificate.json'}")
        say_view(map((folder / "runs").joinpath, map(str, found.failing_runs)))
    return 0 if found.verdict == "shown" else FAILED


def drop_other_days(folder: Path, checked: CheckedFile, number: int | None) -> None:
    """Removes the days of an earlier check if they are of another file, or another number; None: of any."""
    from harness.campaign.folder import FOLDER_SCHEMA
    from harness.campaign.results import INDEX

    days = read_index(folder / INDEX, FOLDER_SCHEMA, MAX_INDEX_BYTES) or {}
    if "path" in days and (number not in (None, days["campaign"]["draws"]) or days["path"] != checked.digest):
        shutil.rmtree(folder)


def fly_path_days(days: Days, folder: Path, *, silent: bool) -> None:
    """Flies a given path on some days into the folder of its check, and prints how often it was flown as given.

    The recording of the check then shows the band in which 95 % of them fly.
    """
    from harness.analysis.band import read_band
    from harness.certification.certification import Terms
    from harness.run_files.run_folder import RECORDING

    resume = (folder / "days" / "campaign.json").exists()
    found = _fly(days, folder / "days", None, Terms(), resume=resume, silent=silent)
    if not silent:
        print_table(f"{found.subject}: {found.runs} days", certificate_rows(found))
        say(f"certificate: {folder / 'days' / 'certificate.json'}")
    if (band := read_band(folder / "days")) is not None and (folder / RECORDING).is_file():
        from harness.recording.overlay import add_band

        add_band(folder / RECORDING, *band[1:])


def _fly(days: Days, folder: Path, workers: int | None, terms: Terms, *, resume: bool, silent: bool) -> Certificate:
    from harness.campaign.workers import local_workers
    from harness.certification.certification import certify as fly_days

    again = resumable(folder, "the same check" if days.band else "--resume")
    with again, local_workers(workers, len(days)) as flyers, step_bar(silent) as bar:
        days.check()

        def report(tally: DayCount) -> None:
            bar(tally.runs, len(days), f"held on {tally.held} of {tally.runs} days")

        return fly_days(days, folder, flyers, terms, resume=resume, progress=report)


def certificate_rows(certificate: Certificate) -> dict[str, str]:
    """Returns the rows of a certificate's table: text by name."""
    sure, drawn = f"{certificate.confidence:.4g}", ", ".join(certificate.varied)
    rows: dict[str, str] = {
        "claim": certificate.claim,
        "conditions": plain("; drawn: ".join((certificate.conditions, *filter(None, [drawn])))),
        "first day": plain(certificate.first_day),
        "held": f"on {certificate.held} of {certificate.runs} days",
        "probability": f"at least {share_text(certificate.probability_lower)}, at most "
        f"{share_text(certificate.probability_upper, up=True)} (each bound at confidence {sure})",
        "bounds": certificate.method,
    }
    if certificate.rare is not None:
        rows |= _rare_rows(certificate.rare, rows["held"])
    claimed = certificate.probability
    least = "" if claimed is None else f": holds on at least {claimed:.6g} of the days"
    rows["verdict"] = f"[{VERDICT_STYLE[certificate.verdict]}]{certificate.verdict}[/]{least}"
    for number, each in enumerate(certificate.failures[:MOST_SHOWN]):
        cause = f", {plain(each.cause)}" if each.cause else ""
        runs = ", ".join(map(str, each.runs)) + (", ..." if each.count > len(each.runs) else "")
        title = f"failed {number + 1}" if number else "failed"
        rows[title] = f"{each.outcome}{cause}: {each.count} (run {runs})"
    for quantity in [each for each in certificate.explained if each.share >= LEAST_SHARE][:MOST_SHOWN]:
        worst = f"most at {plain(quantity.worst)}: {quantity.failed} of {quantity.runs}"
        name = plain(quantity.key)
        share = f"explains {100 * quantity.share:.0f} % of the failures"
        rows[f"{name} drawn" if name in rows else name] = f"{share}; {worst}"
    return rows


def _rare_rows(rare: Rare, held: str) -> dict[str, str]:
    bounds = f"at least {rare.failure_lower:.2g}, at most {rare.failure_upper:.2g}"
    levels = ", ".join(f"{each:.3g}" for each in rare.levels)
    rows = {"failure": f"probability {rare.failure_probability:.2g}, {bounds}"}
    return rows | ({"held": f"{held}, drawn near failure", "levels": f"{levels} (margin)"} if levels else {})


def share_text(value: float, up: bool = False) -> str:
    """Returns a bound of a probability as text, rounded down, or `up`: it claims no more than is known."""
    return f"{(math.ceil if up else math.floor)(value * 1e5) / 1e5:.5f}"
