"""Building the package where there is no C compiler: a clear line, and a package all the same."""

import importlib.util
import itertools
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from levelhead.export import extension

HOOK = Path(__file__).parents[2] / "hatch_build.py"


@pytest.fixture
def _no_compiler(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(extension.sysconfig, "get_config_var", lambda name: "gcc -pthread")


@pytest.mark.usefixtures("_no_compiler")
def test_without_a_compiler_the_error_says_what_is_missing(tmp_path):
    with pytest.raises(extension.NoCompilerError, match=r"no C compiler \(gcc or clang\) is on the PATH"):
        extension.build(tmp_path / "objects", tmp_path / "made.so")
    assert not (tmp_path / "made.so").exists()


@pytest.mark.usefixtures("_no_compiler")
@pytest.mark.skipif(not HOOK.exists(), reason="an installed package has no build hook")
def test_the_package_is_built_without_it_and_says_so(monkeypatch):
    interface = "hatchling.builders.hooks.plugin.interface"  # which is there only while a package is built
    for name in itertools.accumulate(interface.split("."), "{}.{}".format):
        monkeypatch.setitem(sys.modules, name, SimpleNamespace(BuildHookInterface=object))
    monkeypatch.setattr(sys, "path", sys.path[:])
    spec = importlib.util.spec_from_file_location("hatch_build", HOOK)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    said = []

    class App:
        def display_warning(self, words):
            said.append(words)

    hook = module.NativeEngine()
    hook.root, hook.app = str(HOOK.parent), App()
    data = {"force_include": {}}
    hook.initialize("standard", data)
    assert "tag" not in data and "pure_python" not in data, "a wheel for every machine"
    assert set(data["force_include"].values()) == {f"levelhead/docs/{part}" for part in module.PAGES}
    assert len(said) == 1 and "built without its native engine" in said[0] and "no C compiler" in said[0]


@pytest.mark.usefixtures("_no_compiler")
def test_the_compiler_may_be_named(monkeypatch, tmp_path):
    fake = tmp_path / "mycc"
    fake.write_text("#!/bin/sh\n")
    fake.chmod(0o755)
    monkeypatch.setenv("CC", f"{fake} -q")
    assert extension.compiler() == [str(fake), "-q"]
