"""Makes the API reference from the docstrings, a page a module: `python -m tests.reference [FOLDER]`.

Whatever pdoc warns of is an error: a name that does not resolve, an annotation that is none.
"""

import posixpath
import re
import sys
import warnings
from pathlib import Path
from typing import get_type_hints

import pdoc
import pdoc.extract

import wayproof

MODULES = (
    "wayproof",
    *("planner.interface", "planner.registry", "planner.contract"),
    *("aircraft.interface", "aircraft.guidance.interface"),
)
"""The public face: the front door, and what planners, aircraft and guidance laws of others are built on."""
FIRST_PAGE = '<!doctype html><meta http-equiv="refresh" content="0; url=wayproof.html">'
NO_DEFAULT = re.compile(r"\s*=\s*(?:<[^>]*>)*PydanticUndefined(?:</[^>]*>)*")
"""What pydantic holds as the default of a field that has none."""


def write(folder: Path) -> None:
    """Writes the reference into a folder; `index.html` leads to it."""
    for name in wayproof.__all__:
        getattr(wayproof, name)  # pdoc looks for names that are there already
    pdoc.render.configure(docformat="google", search=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in pdoc.extract.walk_specs(MODULES):
            # The constructor of a NamedTuple keeps its annotations as text, without the module that they are of.
            for row in vars(pdoc.extract.load_module(name)).values():
                if isinstance(row, type) and hasattr(row, "_fields"):
                    row.__new__.__annotations__ = get_type_hints(row)
        pdoc.pdoc(*MODULES, output_directory=folder)
    for page in folder.rglob("*.html"):
        page.write_text(_mended(page.read_text("utf-8")), "utf-8")
    (folder / "index.html").write_text(FIRST_PAGE, "utf-8")
    check(folder)


def _mended(text: str) -> str:
    """A page without pydantic's word for no default, and without links to fields that are known by an alias only."""
    places = set(re.findall(r'id="([^"]*)"', text))
    text = NO_DEFAULT.sub("", text)
    return re.sub(r'<a href="#([^"]*)"([^>]*)>(.*?)</a>', lambda link: link[0] if link[1] in places else link[3], text)


def check(folder: Path) -> None:
    """Fails if a page has a link into a page that has no such place, or a default that is none."""
    texts = {page.relative_to(folder).as_posix(): page.read_text("utf-8") for page in folder.rglob("*.html")}
    faults = []
    for name, text in texts.items():
        faults += [f"{name}: PydanticUndefined"] * ("PydanticUndefined" in text)
        for page, _, anchor in (link.partition("#") for link in re.findall(r'href="([^":$]*)"', text)):
            target = posixpath.normpath(posixpath.join(posixpath.dirname(name), page)) if page else name
            if target not in texts or (anchor and f'id="{anchor}"' not in texts[target]):
                faults.append(f"{name}: a dead link to {target}#{anchor}")
    if faults:
        raise SystemExit("\n".join(faults))


if __name__ == "__main__":
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "reference")
    write(out)
    print(f"reference: {out / 'index.html'}")
