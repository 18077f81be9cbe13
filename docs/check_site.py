"""Checks the built site: each link leads to a file and an anchor, and no page loads anything from another host.

python docs/check_site.py build/site          exit code 1 and one line for each fault
"""

import re
import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADS = {"script": "src", "img": "src", "iframe": "src", "source": "src", "link": "href", "video": "src"}
NAMED = {"canonical", "search", "author", "prev", "next", "index", "up"}  # kinds of <link> that load nothing


class Page(HTMLParser):
    """Links, anchors and loaded files of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.anchors: set[str] = set()
        self.unnamed = 0
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collects what a tag names."""
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        if tag in LOADS and LOADS[tag] in given and given.get("rel") not in NAMED:
            self.loads.append(given[LOADS[tag]])
        self.unnamed += tag == "img" and "alt" not in given  # an empty one: decoration


@cache
def page(path: Path) -> Page:
    """Each page is parsed once."""
    return Page(path)


def faults(site: Path) -> list[str]:
    """A line for each fault."""
    found = []
    for path in sorted(path for path in site.rglob("*.html") if "_static" not in path.parts):
        shown = path.relative_to(site)
        for url in page(path).loads:
            if urlsplit(url).netloc:
                found.append(f"{shown} loads {url}")
        if page(path).unnamed:
            found.append(f"{shown} has {page(path).unnamed} pictures without an alternative text")
        for url in {*page(path).links, *page(path).loads}:
            parts = urlsplit(url)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.exists():
                found.append(f"{shown} links to {url}, which is absent")
            elif parts.fragment and target.suffix == ".html" and unquote(parts.fragment) not in page(target).anchors:
                found.append(f"{shown} links to {url}, which has no such anchor")
    for path in site.rglob("*.css"):
        for url in re.findall(r"(?:url\(|@import )['\"]?((?:https?:)?//[^'\")]+)", path.read_text(encoding="utf-8")):
            found.append(f"{path.relative_to(site)} loads {url}")
    return found


if __name__ == "__main__":
    lines = faults(Path(sys.argv[1]))
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    sys.exit(1 if lines else 0)
