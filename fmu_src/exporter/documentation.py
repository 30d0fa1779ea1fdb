"""documentation/ in the FMU: the pages of fmu_src/documentation, whole, as HTML that needs no script.

index.md is the first page. The FMU carries it and the pages that it links, in that order; other pages speak of the
project's files, which a user of the FMU does not have, and stay out. Links between carried pages lead to the HTML
files; a link to a file that is not in the FMU becomes its text. Pictures are carried as they are.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from urllib.parse import unquote

from markdown_it import MarkdownIt
from markdown_it.token import Token

from ..interface import Interface
from .compiler import SOURCE_ROOT
from .model_description import Edition
from .page import PAGE
from .version import project_version

FOLDER = SOURCE_ROOT / "documentation"
INDEX = "index.md"
OTHER_PLACES = {"../../LICENSE": "licenses/license.txt"}  # of what the FMU carries where the project does not
TYPES = {"CoSimulation": "co-simulation", "ModelExchange": "Model Exchange"}
OUTSIDE = re.compile(r"https?://")
COMMENT = re.compile(r"\s*<!--.*?-->\s*", re.DOTALL)

STYLE = """
:root { color-scheme: light dark; --text: #222; --paper: #fff; --quiet: #555; --line: #ccc; --shade: #f3f4f6;
        --link: #0b5394; }
@media (prefers-color-scheme: dark) {
  :root { --text: #e6e6e6; --paper: #1b1e22; --quiet: #aaa; --line: #4a4f55; --shade: #262b31; --link: #7cb8f2; } }
body { font: 16px/1.55 system-ui, sans-serif; color: var(--text); background: var(--paper); max-width: 62rem;
       margin: 1rem auto 4rem; padding: 0 1rem; overflow-wrap: break-word; }
a { color: var(--link); }
nav ul { list-style: none; display: flex; flex-wrap: wrap; gap: 0.25rem 1rem; padding: 0 0 0.75rem; margin: 0;
         border-bottom: 1px solid var(--line); font-size: 0.875rem; }
nav [aria-current] { color: var(--text); font-weight: 600; text-decoration: none; }
h1 { line-height: 1.2; } h2 { margin-top: 2.5rem; border-bottom: 1px solid var(--line); }
.table { overflow-x: auto; margin: 1rem 0; } table { border-collapse: collapse; font-size: 0.875rem; }
th, td { border: 1px solid var(--line); padding: 0.25rem 0.5rem; text-align: left; vertical-align: top;
         overflow-wrap: normal; }
th, code, pre { background: var(--shade); } code { padding: 0 0.2em; } td code { white-space: nowrap; }
pre { padding: 0.75rem; overflow-x: auto; } pre code { padding: 0; }
img { max-width: 100%; height: auto; } .lead { color: var(--quiet); }
"""


class DocumentationError(ValueError):
    """A page, or what a page names, cannot be put into the FMU; the message names both."""


@dataclass(frozen=True)
class Page:
    """A page as HTML.

    name: of its Markdown file; title: its first heading, plain; body: its HTML; links: the pages that it links, in
    order; images: the files that it shows.
    """

    name: str
    title: str
    body: str
    links: tuple[str, ...]
    images: tuple[str, ...]

    @property
    def html_name(self) -> str:
        return html_name(self.name)


def documentation_content(interface: Interface, edition: Edition) -> dict[str, bytes]:
    """The files in the archive, by name, but for the licences."""
    names = carried_pages()
    pages = [read_page(name, names) for name in names]
    content = {page.html_name: _framed(page, pages, _lead(interface, edition)).encode() for page in pages}
    content |= {image: (FOLDER / image).read_bytes() for page in pages for image in page.images}
    return {f"documentation/{name}": data for name, data in content.items()}


def carried_pages() -> list[str]:
    """The Markdown files whose pages are in the FMU: index.md and those that it links."""
    return list(dict.fromkeys((INDEX, *read_page(INDEX, ()).links)))


def read_page(name: str, carried: Iterable[str]) -> Page:
    """The page of one Markdown file, its links as in an FMU that has the pages `carried`.

    Raises DocumentationError where the file, or an image that it shows, is missing, and where it is no plain Markdown.
    """
    if not (FOLDER / name).is_file():
        raise DocumentationError(f"{INDEX} links {name}, which is not in {FOLDER}")
    markdown = MarkdownIt("commonmark").enable("table")
    markdown.add_render_rule("table_open", lambda *_: '<div class="table"><table>\n')
    markdown.add_render_rule("table_close", lambda *_: "</table></div>\n")
    tokens = markdown.parse((FOLDER / name).read_text(encoding="utf-8"))
    if any(COMMENT.sub("", token.content) for token in tokens if token.type == "html_block"):
        raise DocumentationError(f"{name} contains HTML: pages are Markdown alone")
    tokens = [token for token in tokens if token.type != "html_block"]  # comments
    if not tokens or (tokens[0].type, tokens[0].tag) != ("heading_open", "h1"):
        raise DocumentationError(f"{name} does not begin with its title")

    headings = [(token, tokens[k + 1]) for k, token in enumerate(tokens) if token.type == "heading_open"]
    for (opening, _), identifier in zip(headings, anchors(plain(inline) for _, inline in headings), strict=True):
        opening.attrSet("id", identifier)
    links: list[str] = []
    images: list[str] = []
    for inline in (token for token in tokens if token.type == "inline"):
        inline.children = list(_converted(inline.children or [], name, set(carried), links, images))
    body = markdown.renderer.render(tokens, markdown.options, {})
    return Page(name, plain(headings[0][1]), body, tuple(links), tuple(images))


def html_name(page: str) -> str:
    return page.removesuffix(".md") + ".html"


def plain(inline: Token) -> str:
    """The text of a heading without its marks."""
    return "".join(child.content for child in inline.children or [] if child.type in ("text", "code_inline"))


def anchors(headings: Iterable[str]) -> list[str]:
    """The fragment identifier of each heading, as GitHub makes them: links hold there and in the FMU."""
    found: list[str] = []
    for heading in headings:
        name = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        repeated = sum(re.fullmatch(rf"{re.escape(name)}(-\d+)?", other) is not None for other in found)
        found.append(f"{name}-{repeated}" if repeated else name)
    return found


def _converted(
    children: Sequence[Token], page: str, carried: set[str], links: list[str], images: list[str]
) -> Iterator[Token]:
    """The parts of a paragraph with their links as in the FMU; notes the pages linked and the images shown."""
    within = False  # a link that is kept; links do not nest
    for child in children:
        if child.type == "link_open":
            target, _, fragment = str(child.attrGet("href")).partition("#")
            if target.endswith(".md") and "/" not in target:
                links.append(target)
            new = _target(target, carried)
            within = new is not None
            if new is None:
                continue
            child.attrSet("href", f"{new}#{fragment}" if fragment else new)
        elif child.type == "link_close" and not within:
            continue
        elif child.type == "image":
            image = unquote(str(child.attrGet("src")))
            if "/" in image or not (FOLDER / image).is_file():
                raise DocumentationError(f"{page} shows {image}, which is not in {FOLDER}")
            images.append(image)
        elif child.type == "html_inline":
            raise DocumentationError(f"{page} contains HTML, {child.content}: pages are Markdown alone")
        yield child


def _target(target: str, carried: set[str]) -> str | None:
    """Where a link leads in the FMU; None where that is not there."""
    if not target or OUTSIDE.match(target):
        return target
    if target in carried:
        return html_name(target)
    return OTHER_PLACES.get(target)


def _lead(interface: Interface, edition: Edition) -> str:
    """The way to the explorer, and what this file is: the one thing that differs between the FMUs."""
    types = " and ".join(TYPES[name] for name in sorted(edition.capabilities))
    return (
        f'<p><a href="{PAGE}"><b>Open the explorer</b></a>: change any parameter and see the motion change; it '
        "computes with this FMU, in the browser, and asks nothing of any server.</p>\n"
        f'<p class="lead">This file is {escape(interface.model.name + edition.suffix)}, version '
        f"{escape(project_version())}, for FMI {edition.fmi}.0, {types}{escape(edition.remark)}.</p>"
    )


def _framed(page: Page, pages: Sequence[Page], lead: str) -> str:
    entries = (
        f'<li><a href="{other.html_name}"{" aria-current=page" if other is page else ""}>{escape(other.title)}</a></li>'
        for other in pages
    )
    title, end, rest = page.body.partition("</h1>\n")
    body = f"{title}{end}{lead}\n{rest}" if page.name == INDEX else page.body
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(page.title)}</title>
<style>{STYLE}</style>
</head>
<body>
<nav aria-label="Pages"><ul>
{"".join(entries)}
</ul></nav>
<main>
{body}</main>
</body>
</html>
"""
