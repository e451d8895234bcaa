"""What the scripts that fly tables share: rows in Markdown, the bound of a share, and their places on a page."""

from pathlib import Path
from typing import Final

from harness.certification.bounds import clopper_pearson

MEASURED: Final = Path(__file__).parents[2] / "planner" / "MEASURED.md"


def line(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


def head(*names: str) -> list[str]:
    return [line(*names), line(*["---"] * len(names))]


def upper(hits: int, flights: int) -> float:
    """One-sided upper bound at 95 % of the share of flights that hit (Clopper and Pearson)."""
    return 1.0 - clopper_pearson(flights - hits, flights, 0.95)[0]


def fill(name: str, text: str, page: Path = MEASURED) -> None:
    """Puts a text on a page, between the marks `<!-- NAME -->` and `<!-- end -->`."""
    before, begin, rest = page.read_text("utf-8").partition(f"<!-- {name} -->\n")
    _, end, after = rest.partition("<!-- end -->")
    assert end, f"{page} has no place for {name}"
    page.write_text(f"{before}{begin}{text.rstrip()}\n{end}{after}", encoding="utf-8")
