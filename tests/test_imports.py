"""No import circle in any file: each module is understood after those that it imports, wherever the import stands."""

import graphlib

import grimp
import pytest

NATIVE = "from levelhead.engine import _native"  # compiled: no module that grimp finds, so it takes the package for it


def imports_of(graph: grimp.ImportGraph) -> dict[str, set[str]]:
    """What each module imports, in functions and for type checkers too."""
    return {
        module: {
            imported
            for imported in graph.find_modules_directly_imported_by(module)
            if {found["line_contents"] for found in graph.get_import_details(importer=module, imported=imported)}
            != {NATIVE}
        }
        for module in graph.modules
    }


def test_the_package_has_no_import_circle() -> None:
    imports = imports_of(grimp.build_graph("levelhead", cache_dir=None))
    assert len(imports) > 400
    graphlib.TopologicalSorter(imports).prepare()  # CycleError names the circle


def test_a_circle_is_found() -> None:
    graph = grimp.ImportGraph()
    for importer, imported in (("a", "b"), ("b", "c"), ("c", "a"), ("c", "d")):
        graph.add_import(importer=importer, imported=imported, line_number=1, line_contents=f"import {imported}")
    with pytest.raises(graphlib.CycleError) as caught:
        graphlib.TopologicalSorter(imports_of(graph)).prepare()
    assert set(caught.value.args[1]) == {"a", "b", "c"}
