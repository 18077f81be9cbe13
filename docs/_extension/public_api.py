"""Signatures as people read them: one name for each type, and each type leads to its documentation.

The inventory of Python's and NumPy's names is a list of this file, so a build needs no network.
"""

import re

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.ext.napoleon.docstring import GoogleDocstring
from sphinx.util.nodes import make_refnode

ALIASES = (  # a pattern of what the signature has, and its name in docs/reference/api.rst
    (r"numpy\.ndarray\[tuple\[typing\.Any, \.\.\.\], numpy\.dtype\[numpy\.float64\]\]", "Array"),
    (r"numpy\.ndarray\[tuple\[typing\.Any, \.\.\.\], numpy\.dtype\[numpy\.(\w+)\]\]", r"numpy.ndarray"),
    (r"(?:levelhead\.filters\.parameters\.)?Params \| type\[(?:levelhead\.filters\.parameters\.)?Params\] \| str",
     "FilterChoice"),
    (r"str \| os\.PathLike\[str\] \| collections\.abc\.Iterable\[str \| os\.PathLike\[str\]\]", "Places"),
    (r"str \| os\.PathLike\[str\]", "PathLike"),
    (r"collections\.abc\.Callable\[\[float\], None\] = <function <lambda> at 0x\w+>", "Progress = no_progress"),
    (r"collections\.abc\.Callable\[\[float\], None\]", "Progress"),
    (r"collections\.abc\.Sequence\[float\] \| Array", "Vector"),
    (r"<factory>", "..."),
    (r"<built-in function (\w+)>", r"\1"),
    (r" at 0x\w+", ""),
    (r"Guard\(gyr_range=[^)]*\)", "Guard()"),
)  # fmt: skip
PROPERTIES: dict[str, list[str]] = {}  # docstrings while napoleon is at work
PYTHON = "https://docs.python.org/3/"
KNOWN = {  # names of the standard library and NumPy in our signatures, and their pages
    **dict.fromkeys(("str", "bytes", "dict", "list", "tuple", "set", "frozenset", "range"), "library/stdtypes.html"),
    **dict.fromkeys(("int", "float", "bool", "object", "type", "slice", "complex"), "library/functions.html"),
    **dict.fromkeys(("ValueError", "KeyError", "TypeError", "OSError", "RuntimeError"), "library/exceptions.html"),
    **dict.fromkeys(("None", "True", "False"), "library/constants.html"),
    **dict.fromkeys(("Any", "Literal", "Self", "NamedTuple"), "library/typing.html"),
    **dict.fromkeys(("Sequence", "Mapping", "Iterable", "Iterator", "Callable", "Generator"),
                    "library/collections.abc.html"),
    "Path": "library/pathlib.html", "PathLike": "library/os.html",
}  # fmt: skip
NUMPY = "https://numpy.org/doc/stable/reference/generated/"

SCIPY = "https://docs.scipy.org/doc/scipy/reference/generated/"


def shorten(text: str) -> str:
    """A signature or annotation with the names of ``ALIASES``."""
    text = re.sub(r"~(?=\w+\.)", "", text)
    for pattern, name in ALIASES:
        text = re.sub(pattern, name, text)
    return text


def process(
    app: Sphinx, what: str, name: str, obj: object, options: object, signature: str | None, returns: str | None
):
    """Shortens what autodoc is about to print."""
    return (signature and shorten(signature), returns and shorten(returns))


def set_aside(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Napoleon reads "words: more words" at the start of a property as its type, so a property is kept from it."""
    if what == "property":
        PROPERTIES[name] = str(GoogleDocstring(lines, app.config, app, "method", name, obj, options)).splitlines()
        lines[:] = ["."]


def put_back(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """The docstring of a property, as that of a method."""
    if what == "property":
        lines[:] = PROPERTIES.pop(name)


def shorten_properties(app: Sphinx, doctree: nodes.document) -> None:
    """The type of a property does not pass through autodoc's signatures."""
    for node in doctree.findall(addnodes.desc_annotation):
        short = re.sub(r"ndarray\[tuple\[Any, \.\.\.\], dtype\[\w+\]\]", "Array", text := node.astext())
        if short != text:
            node.children = [nodes.Text(short)]


def resolve(app: Sphinx, env: BuildEnvironment, node: addnodes.pending_xref, text: nodes.Element):
    """Where a name leads that Sphinx does not find: to the public name of a class, or to Python's or NumPy's pages."""
    if node.get("refdomain") != "py":
        return None
    target = str(node.get("reftarget", ""))
    last = target.rpartition(".")[2]
    domain = env.domains.python_domain
    for name in (f"levelhead.{last}", f"levelhead.simulate.{last}", f"levelhead.live.{last}", last):
        if name in domain.objects:
            found = domain.objects[name]
            return make_refnode(app.builder, str(node["refdoc"]), found.docname, found.node_id, text, name)
    url = outside(target)
    if url:
        return nodes.reference("", "", text, internal=False, refuri=url)
    return text if target.startswith("levelhead.") else None  # an inner class: named, without a page


def outside(target: str) -> str | None:
    """The page of a name of Python, NumPy or SciPy."""
    last = target.rpartition(".")[2]
    if last in KNOWN:
        return PYTHON + KNOWN[last]
    if target.startswith("numpy"):
        return f"{NUMPY}numpy.{last}.html"
    return f"{SCIPY}scipy.spatial.transform.Rotation.html" if last == "Rotation" else None


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the extension."""
    app.connect("autodoc-process-signature", process)
    app.connect("autodoc-process-docstring", set_aside, priority=100)  # before napoleon
    app.connect("autodoc-process-docstring", put_back, priority=900)  # after it
    app.connect("doctree-read", shorten_properties)
    app.connect("missing-reference", resolve)
    return {"parallel_read_safe": True}
