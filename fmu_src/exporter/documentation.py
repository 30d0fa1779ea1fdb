"""documentation/index.html in the FMU: one page that needs no other file.

Every fact comes from where it is at home: the texts from README.md, the tables from interface.toml,
reference/experiments.toml and documentation/published.csv (a copy of what the published planting cycle wrote,
scenarios/paper_cycle.py; a test tells when it is stale), the drawing from linkage.svg.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from html import escape
from importlib import metadata

from markdown_it import MarkdownIt

from ..interface import Interface
from .compiler import SOURCE_ROOT
from .generate import README, interface_rows
from .model_description import Edition
from .reference import FOLDER as REFERENCE_FOLDER
from .reference import definitions
from .terminals import TERMINALS, members
from .version import DISTRIBUTION, project_version

PUBLISHED = SOURCE_ROOT / "documentation" / "published.csv"
# The pieces of README.md that a user of the FMU needs: headings of the second level, or bold beginnings of a
# paragraph. Each goes on to the next such beginning.
PIECES = ("What to connect", "What the crank inputs buy", "Without any lag", "Gradients", "What can go wrong",
          "How exact, how fast", "Limits")  # fmt: skip
BEGINNING = re.compile(r"^(?:## (?P<heading>.+)|\*\*(?P<bold>[^*]+?)\.?\*\* ?|<!--.*-->)", re.MULTILINE)
BEGIN = re.compile(r"^# .+\n+(?P<text>(?s:.+?))\n\n", re.MULTILINE)  # the title and the first paragraph
FIGURE = re.compile(r"!\[[^\]]*\]\([^)]*\)\s*(The figure [^.]*\.\s)?")  # with the sentence that speaks of it
LINK = re.compile(r"\[([^\]]+)\]\((?!https?://)[^)]*\)")  # to files of the project: they are not in the FMU

TYPES = {"CoSimulation": "co-simulation", "ModelExchange": "Model Exchange"}

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #222; background: #fff; max-width: 60rem; margin: 2rem auto;
       padding: 0 1rem; }
h1 { margin-bottom: 0; } h2 { margin-top: 2.5rem; border-bottom: 1px solid #ccc; }
table { border-collapse: collapse; margin: 1rem 0; font-size: 0.875rem; display: block; overflow-x: auto; }
th, td { border: 1px solid #ddd; padding: 0.25rem 0.5rem; text-align: left; vertical-align: top; }
th { background: #f4f4f4; } code { background: #f4f4f4; padding: 0 0.2em; white-space: nowrap; }
svg { max-width: 100%; height: auto; } .lead { color: #555; }
"""


class DocumentationError(ValueError):
    """A piece of README.md that the documentation quotes is not there; the message names it."""


def documentation_content(interface: Interface, edition: Edition) -> dict[str, bytes]:
    """The files in the archive, by name, but for the licences."""
    pages = {"index.html": _index(interface, edition), "fmi-ls-ref.html": _experiments(interface)}
    return {f"documentation/{name}": page.encode() for name, page in pages.items()}


def _index(interface: Interface, edition: Edition) -> str:
    model, readme = interface.model, _readme()
    types = " and ".join(TYPES[name] for name in sorted(edition.capabilities))
    drawing = (SOURCE_ROOT / "linkage.svg").read_text(encoding="utf-8").partition("?>")[2]
    signals = [(name, text, ", ".join(members(interface, name))) for name, (_, _, _, text) in TERMINALS.items()]
    with PUBLISHED.open(newline="", encoding="utf-8") as file:
        published = list(csv.DictReader(file))
    verdicts = [row["verdict"] for row in published]
    columns = ("paper section", "published", "computed", "verdict", "reason")
    return _page(
        f"{model.name}{edition.suffix}",
        f"""<p class="lead">{escape(model.description + edition.remark)}. Version {escape(project_version())}; this file
is for FMI {edition.fmi}.0, {types}.</p>
{MarkdownIt().render(introduction(readme))}
{drawing}
<p>In the drawing the cranks OA and CD turn together, clockwise; J is the tip of the nozzle that plants.</p>
{"".join(_section(name, text) for name, text in pieces(readme).items())}
<h2>Interface</h2>
<p>SI units; hosts may show those in modelDescription.xml (mm, degrees, rpm, km/h).</p>
{_table(("#", "name", "kind", "unit", "start", "meaning"), interface_rows(interface), code=1)}
<h2>Terminals</h2>
<p>Variables that are connected together, for hosts that read terminalsAndIcons.xml.</p>
{_table(("terminal", "what it is", "members"), signals, code=0)}
<h2>Check your host</h2>
<p>The FMU carries exact results: see <a href="fmi-ls-ref.html">the experiments</a>. <code>linkage-fmu validate
FILE</code>, of the Python package {DISTRIBUTION}, runs them with this file, beside its other checks.</p>
<h2>The published planting cycle</h2>
<p>The paper's figures and sentences beside what this component gives: {verdicts.count("agrees")} agree,
{verdicts.count("differs")} differ, {verdicts.count("not determined")} are not determined by the paper.</p>
{_table(columns, ([row[name] for name in columns] for row in published))}
<h2>Licence</h2>
<p>BSD-2-Clause: <a href="licenses/license.txt">licenses/license.txt</a>.</p>
""",
    )


def _experiments(interface: Interface) -> str:
    found = definitions(interface)
    units = list(found[0].tolerance)
    rows = [
        (of.name, f"{of.stop:g} s", f"{of.step:g} s", *(f"{of.tolerance[u]:.0e}".replace("e-0", "e-") for u in units))
        for of in found
    ]
    described = "".join(f"<dt><code>{of.name}</code></dt><dd>{escape(of.description)}</dd>" for of in found)
    return _page(
        f"{interface.model.name}: reference results",
        f"""<p>The folder {REFERENCE_FOLDER} holds, as the FMI layered standard FMI-LS-REF lays it down, parameter
sets (SSV) and experiments (reference.exp), each with its inputs and exact outputs (CSV). The outputs were computed
with 50 digits; each is the double nearest to the exact value. Between the rows of the inputs a host interpolates
linearly.</p>
<dl>{described}</dl>
<p>To check a host: set the parameters of an experiment, run it with its inputs and step, and compare. Every output
lies within the absolute tolerance for its unit:</p>
{_table(("experiment", "end", "step", *units), rows, code=0)}
""",
    )


def introduction(readme: str) -> str:
    """The first paragraph of README.md, as Markdown; raises DocumentationError where there is none."""
    if (begin := BEGIN.search(readme)) is None:
        raise DocumentationError("README.md has no title with a paragraph, which the FMU's documentation quotes")
    return LINK.sub(r"\1", begin["text"])


def pieces(readme: str) -> dict[str, str]:
    """PIECES of README.md: {name: Markdown}; raises DocumentationError where one is missing."""
    begins = list(BEGINNING.finditer(readme))
    found = {}
    for this, after in zip(begins, [*begins[1:], None]):
        name = this["heading"] or this["bold"]
        if name in PIECES:
            text = readme[this.end() : after.start() if after else None]
            found[name] = LINK.sub(r"\1", FIGURE.sub("", text)).strip()
    if missing := [name for name in PIECES if not found.get(name)]:
        raise DocumentationError(f"README.md has no piece {missing[0]!r}, which the FMU's documentation quotes")
    return {name: found[name] for name in PIECES}


def _readme() -> str:
    """README.md; of an installed distribution, the copy in its description."""
    if README.is_file():
        return README.read_text(encoding="utf-8")
    return metadata.metadata(DISTRIBUTION)["Description"] or ""


def _section(name: str, text: str) -> str:
    return f"<h2>{escape(name)}</h2>\n{MarkdownIt().enable('table').render(text)}"


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]], code: int | None = None) -> str:
    """An HTML table; the column number `code` in typewriter letters."""

    def line(cells: Iterable[str], tag: str, marked: int | None = None) -> str:
        texts = (f"<code>{escape(c)}</code>" if k == marked else escape(c) for k, c in enumerate(cells))
        return "<tr>" + "".join(f"<{tag}>{text}</{tag}>" for text in texts) + "</tr>"

    return "\n".join(["<table>", line(headings, "th"), *(line(row, "td", code) for row in rows), "</table>"])


def _page(title: str, body: str) -> str:
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(title)}</title>
<style>{STYLE}</style>
</head>
<body>
<h1>{escape(title)}</h1>
{body}</body>
</html>
"""
