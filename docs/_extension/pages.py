"""Changes pages as the site reads them: the help of every verb, and links that leave the folder docs."""

import re

from sphinx.application import Sphinx

MARK = "<!-- help of all verbs -->"
OUTSIDE = re.compile(r"\[([^]]+)\]\((?:\.\./)+((?:benchmarks|examples|tests|src)[^)#]*|README\.md)(?:#[^)]*)?\)")


def verbs_help() -> str:
    """Markdown with a heading for each verb, as `levelhead VERB --help` prints it."""
    from levelhead.cli import VERBS, app  # noqa: PLC0415 - only where the page is read

    text = app.generate_docs(output_format="markdown", include_hidden=False)
    start = text.index(f"## levelhead {next(iter(VERBS))}\n")
    return re.sub(r"\n {4,}(?=\S)", " ", text[start:])  # a continued line is no code


def change(app: Sphinx, name: str, source: list[str]) -> None:
    """Fills the mark, leads to the copy of CONTRIBUTING.md, and names a file of the repository without a link."""
    text = source[0]
    if MARK in text:
        text = text.replace(MARK, verbs_help())
    text = re.sub(r"\]\((?:\.\./)+CONTRIBUTING\.md", "](/explanation/contributing.md", text)
    source[0] = OUTSIDE.sub(lambda link: f"{link[1]} (`{link[2]}`)", text)


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the extension."""
    app.connect("source-read", change)
    return {"parallel_read_safe": True}
