"""``levelhead help TOPIC``: the pages of the documentation in the terminal, without a network."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from levelhead.cli.options import print_line
from levelhead.errors import FAMILIES, Family, LevelheadError, nearest

PACKAGED = Path(__file__).parents[1] / "docs"  # a wheel holds the pages here, a checkout in its own folder
FOLDER = PACKAGED if PACKAGED.is_dir() else Path(__file__).parents[3] / "docs"
PARTS = {
    "tutorials": "Tutorials",
    "howto": "How-to guides",
    "coming-from": "Coming from another package",
    "reference": "Reference",
    "explanation": "Explanation",
}


def help(topic: Annotated[str, Parameter(metavar="TOPIC")] = "", /) -> None:
    """Show a page of the documentation, the cause and cure of an error, or the list of all topics.

    Args:
        topic: name of a page, such as yaw-drift, or the code of an error, such as clock; without it, the names of all.
    """
    from rich.console import Console
    from rich.markdown import Markdown

    families = {family.code: family for family in FAMILIES}
    if topic.lower() in families:
        Console().print(Markdown(entry(families[topic.lower()])))
        return
    known = pages()
    if not topic:
        print_line("\n".join(_index(known)))
        return
    page = known.get(topic.lower())
    if page is None:
        words = nearest(topic, [*known, *families])
        raise LevelheadError(f"there is no page '{topic}'; {words}; levelhead help lists all")
    Console().print(Markdown(plain(page.read_text(encoding="utf-8"))))


def entry(family: Family) -> str:
    """Cause, cure and page of a family of errors, as Markdown."""
    return f"{family.cause}\n\n**Cure.** {family.cure}\n\nMore: `levelhead help {family.page}`"


def pages() -> dict[str, Path]:
    """Name → file of each page.

    Raises:
        LevelheadError: this installation has none.
    """
    found = {
        path.stem.lower(): path
        for part in PARTS
        for path in sorted((FOLDER / part).rglob("*.md"))
        if path.stem != "index" and title(path)  # a page that is made of another file has no heading
    }
    if not found:
        raise LevelheadError(
            "this levelhead was installed without its documentation; the archive of the sources has it"
        )
    return found


def title(page: Path) -> str:
    """The heading of a page; "": it has none."""
    lines = page.read_text(encoding="utf-8").splitlines()
    return next((line[2:] for line in lines if line.startswith("# ")), "")


def plain(text: str) -> str:
    """A page without the parts that only its site shows."""
    return "\n".join(line for line in text.splitlines() if not line.startswith((":::", "<!--", "```{")))


def _index(known: dict[str, Path]) -> Iterator[str]:
    """Each page with its title, in the order of the site."""
    for part, words in PARTS.items():
        yield f"{words}:"
        for name, path in known.items():
            if path.is_relative_to(FOLDER / part):
                yield f"  {name:<22} {title(path)}"
    yield "Errors, with cause and cure:"
    for family in FAMILIES:
        yield f"  {family.code:<22} {family.cause}"
    yield "levelhead help TOPIC shows one of them; levelhead VERB --help shows the options of a verb"
