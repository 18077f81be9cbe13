"""Late binding: what is bound is called, what is not bound or not declared is refused with a clear sentence."""

from typing import Any, Protocol

import pytest

from levelhead import filters
from levelhead.compiler.compile import compile_kernel
from levelhead.compiler.hooks import Namespace, declare, fill, rebind
from levelhead.compiler.mark import kernel, list_mentions, list_reachable, noinline
from levelhead.engine import conditioning, driver, lane_kernels, stepper
from levelhead.engine.binding import bind


class Hooks(Protocol):
    """Two hooks, of which the second is optional."""

    SCALE: float

    @staticmethod
    def change(x: float) -> float:
        """Required."""
        ...

    @staticmethod
    @kernel
    def after(x: float) -> float:
        """Optional; calls the other one."""
        return hooks.change(x) + 1.0


hooks: Hooks = declare(Hooks)


@noinline
def inner(x: float) -> float:
    return hooks.SCALE * hooks.change(x)


@kernel
def untouched(x: float) -> float:
    return x - 1.0


@kernel
def outer(x: float) -> float:
    return hooks.after(inner(untouched(x)))


@kernel
def double(x: float) -> float:
    return x + x


@kernel
def negate(x: float) -> float:
    return -x


def bound(**members: Any) -> Any:
    return rebind(outer, ((hooks, fill(hooks, "Test", **members)),), "Test")


def test_each_copy_calls_its_own_functions_however_deep():
    first, second = bound(SCALE=10.0, change=double), bound(SCALE=1.0, change=negate, after=double)
    assert first(3.0) == 2.0 * (10.0 * 4.0) + 1.0 and second(3.0) == -4.0
    assert (first.__qualname__, second.__module__) == ("outer_Test", __name__)


def test_copies_that_call_the_same_functions_are_one_and_the_others_are_not():
    """What two filters share is compiled once; only the outermost copy has a filter's name."""

    def inner_of(owner: str, **members: Any) -> Any:
        made = rebind(outer, ((hooks, fill(hooks, owner, **members)),), owner)
        return next(one for one in list_reachable(made) if one.__name__ == "inner")

    first = inner_of("A", SCALE=10.0, change=double)
    assert inner_of("B", SCALE=10.0, change=double, after=negate) is first and first.__qualname__ == "inner"
    others = (inner_of("C", SCALE=10.0, change=negate), inner_of("D", SCALE=2.5, change=double))
    assert all(one is not first for one in others) and others[1](3.0) == 2.5 * 6.0
    condition = {
        flt.name: next(one for one in list_reachable(bind(flt).run) if one.__name__ == "condition")
        for flt in filters.ALL
    }
    assert condition["EKF"] is condition["Mahony"] is not condition["GyroIntegration"]


@pytest.mark.compiled
def test_the_compiled_twin_has_the_same_result():
    for one in (bound(SCALE=10.0, change=double), bound(SCALE=1.0, change=negate, after=double)):
        assert compile_kernel(one)(3.0) == one(3.0)


def test_a_kernel_that_reaches_no_hook_is_not_copied_and_marks_are_kept():
    assert rebind(untouched, ((hooks, fill(hooks, "Test", SCALE=1.0, change=double)),)) is untouched
    copies = {function.__name__: function for function in list_reachable(bound(SCALE=1.0, change=double))}
    assert copies["untouched"] is untouched
    assert copies["inner"] is not inner and hasattr(copies["inner"], "__noinline__")
    inlined = rebind(outer, ((hooks, fill(hooks, "Test", SCALE=1.0, change=double)),), inline=True)
    assert not any(hasattr(function, "__noinline__") for function in list_reachable(inlined))


def test_a_kernel_stands_in_for_another_one():
    assert rebind(bound(SCALE=1.0, change=double), ((untouched, negate),))(3.0) == -3.0 * 2.0 * 2.0 + 1.0


@pytest.mark.parametrize(
    ("members", "sentence"),
    [
        ({"SCALE": 1.0}, "Hooks of Test: 'change' is not bound"),
        ({"change": double}, "Hooks of Test: 'SCALE' is not bound"),
        ({"SCALE": 1.0, "chance": double}, "Hooks of Test: there is no 'chance'; did you mean 'change'?"),
        ({"SCALE": 1.0, "change": lambda x, y: x}, "'change' takes 1 arguments, but .*<lambda> takes 2"),
    ],
)
def test_what_is_not_bound_or_not_declared_is_refused(members, sentence):
    with pytest.raises(TypeError, match=sentence):
        fill(hooks, "Test", **members)


def test_a_driver_that_is_bound_to_no_filter_says_so():
    with pytest.raises(AttributeError, match=r"Hooks\.init is not bound; engine\.binding\.bind binds"):
        driver.begin(driver.Settings(None, None))


@kernel
def two_deep(x: float) -> float:
    return driver.hooks.init(x, x, x, x)  # type: ignore[arg-type]


def test_a_module_inside_a_module_is_refused_because_it_would_not_be_bound():
    with pytest.raises(TypeError, match=r"two_deep uses driver\.hooks\.….*import driver\.hooks by itself"):
        list(list_mentions(two_deep))


@pytest.mark.parametrize("flt", filters.ALL, ids=lambda f: f.name)
def test_nothing_is_left_unbound_in_a_filter_s_driver(flt):
    one = bind(flt)
    declared = {driver.hooks, driver.aiding, conditioning.detectors, lane_kernels.hooks, stepper.memory}
    for function in filter(None, (one.begin, one.advance, one.result, one.run, one.update_aiding, one.run_with_aiding)):
        used = {id(value) for each in list_reachable(function) for value in used_namespaces(each)}
        assert used and used.isdisjoint(map(id, declared))


def used_namespaces(function):
    names = function.__code__.co_names
    return [value for name, value in function.__globals__.items() if name in names and isinstance(value, Namespace)]
