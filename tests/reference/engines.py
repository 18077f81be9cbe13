"""The engines as a test's parameters: native where it was built, from the sources as they are."""

import pytest

from levelhead.engine import native

PYTHON = "python"
NATIVE = pytest.param(
    "native",
    marks=pytest.mark.skipif(not native.up_to_date(), reason="no native engine of these sources: make native"),
)
COMPILED = pytest.param("compiled", marks=pytest.mark.compiled)
COMPILED_LATE = pytest.param("compiled", marks=[pytest.mark.compiled, pytest.mark.full])  # filters of a minute
ENGINES = [PYTHON, NATIVE, COMPILED]
EVERY_ENGINE = pytest.mark.parametrize("engine", ENGINES)
MACHINE_CODE = pytest.mark.parametrize("engine", [NATIVE, COMPILED])


def skip_second_compilation(engine: str, guard: object) -> None:
    """Numba compiles a smoother for half a minute: with a guard only; the native engine runs without one too."""
    if engine == "compiled" and guard is None:
        pytest.skip("compiled with a guard only")
