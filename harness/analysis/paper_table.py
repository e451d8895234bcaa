"""A table as text for a paper: LaTeX, CSV or Markdown."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from typing import Final, Literal, TypeAlias

from harness.analysis.rows import escaped
from harness.files.wording import printable

Format: TypeAlias = Literal["latex", "csv", "markdown"]

LATEX: Final = str.maketrans(
    {
        **{each: f"\\{each}" for each in "&%$#_{}"},
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"$<$",
        ">": r"$>$",
        "\N{EN DASH}": "--",
        "\N{GREEK SMALL LETTER KAPPA}": r"$\kappa$",
        "\N{MIDDLE DOT}": r"$\cdot$",
        "\N{DEGREE SIGN}": r"$^\circ$",
    }
)
"""What LaTeX takes for something else, or its fonts lack, as it takes it."""


def paper_table(
    heads: Sequence[str], rows: Sequence[Sequence[str]], of: Format, legend: Sequence[str] = ()
) -> str:
    """A table with one line of headings; the first column is aligned left, numbers right.

    LaTeX's is a `tabular` with the rules of the package booktabs; comments before it say so, and have the legend.
    In Markdown the legend is a list behind the table. CSV has none: its readers know no comments.
    """
    if of == "csv":
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([[*map(printable, row)] for row in (heads, *rows)])
        return text.getvalue()
    if of == "markdown":
        rule = ["---", *("---:" for _ in heads[1:])]
        cells = [[*map(escaped, heads)], rule, *([*map(escaped, row)] for row in rows)]
        told = "".join(f"- {escaped(each)}\n" for each in legend)
        return "".join(f"| {' | '.join(row)} |\n" for row in cells) + (told and f"\n{told}")
    first, *others = (" & ".join(printable(cell).translate(LATEX) for cell in row) for row in (heads, *rows))
    lines = [
        r"% \usepackage{booktabs}",
        *(f"% {printable(each)}" for each in legend),
        f"\\begin{{tabular}}{{l{'r' * (len(heads) - 1)}}}",
        "\\toprule",
        f"{first} \\\\",
        "\\midrule",
        *(f"{line} \\\\" for line in others),
        "\\bottomrule",
        "\\end{tabular}",
    ]
    return "\n".join(lines) + "\n"
