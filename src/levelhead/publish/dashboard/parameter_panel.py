"""A slider and a box in the parameter's unit for each parameter of a filter, made from its description."""

import math
from collections.abc import Callable

from levelhead.filters.parameters import Param, Params, param_table
from levelhead.open_types import Untyped

NOTCHES = 200  # steps of a slider
# viser's slider has a box of its own, which holds the notch; ours beside it holds the value.
STYLE = "<style>.mantine-Flex-root:has(> .mantine-Slider-root) > .mantine-NumberInput-root { display: none; }</style>"


class SliderScale:
    """A parameter's range as the notches of a slider, by factors where the parameter says so."""

    def __init__(self, param: Param, value: float) -> None:
        low, high = param.sweep or (min(0.5 * value, value - 1.0), max(2.0 * value, value + 1.0))
        self.low, self.high = max(min(low, value), param.low), min(max(high, value), param.high)
        self.log = param.log and self.low > 0.0

    def notch(self, value: float) -> int:
        """The notch nearest to a value."""
        if self.high <= self.low:
            return 0
        if self.log:
            share = math.log(value / self.low) / math.log(self.high / self.low) if value > 0.0 else 0.0
        else:
            share = (value - self.low) / (self.high - self.low)
        return round(NOTCHES * min(1.0, max(0.0, share)))

    def value(self, notch: float) -> float:
        """The value of a notch, with four digits."""
        share = notch / NOTCHES
        value = self.low * (self.high / self.low) ** share if self.log else self.low + share * (self.high - self.low)
        return float(f"{value:.4g}")


class ParameterPanel:
    """The folder with all parameters.

    Args:
        gui: viser's.
    """

    def __init__(self, gui: Untyped) -> None:
        self._gui = gui
        self._folder: Untyped = None
        self._setters: dict[str, Callable[[float | bool], None]] = {}
        gui.add_html(STYLE)

    def show(self, params: Params, change: Callable[[str, float | bool], None]) -> None:
        """Makes the widgets anew; ``change`` gets name and value when a person changes one."""
        if self._folder is not None:
            self._folder.remove()
        self._setters.clear()
        self._folder = self._gui.add_folder(f"Parameters of {type(params).__name__}")
        with self._folder:
            for name, param in param_table(type(params)).items():
                self._add(name, param, getattr(params, name), change)

    def set(self, params: Params) -> None:
        """Shows other values, such as those that the node has taken."""
        for name, setter in self._setters.items():
            setter(getattr(params, name))

    def _add(self, name: str, param: Param, value: float | bool, change: Callable[[str, float | bool], None]) -> None:
        gui = self._gui
        if isinstance(value, bool):
            switch = gui.add_checkbox(name, value, hint=param.doc)
            switch.on_update(lambda event: change(name, bool(switch.value)) if event.client is not None else None)
            self._setters[name] = lambda new: setattr(switch, "value", bool(new))
            return
        scale = SliderScale(param, value)
        marks = ((0, f"{scale.low:.4g}"), (NOTCHES, f"{scale.high:.4g}"))
        # A word joiner behind each slash: on a phone the unit stands on a line of its own, and whole.
        unit = param.unit.replace("/", "/\u2060")
        label = f"{name} [{unit}]" if unit else name
        slider = gui.add_slider(name, 0, NOTCHES, 1, scale.notch(value), marks=marks, hint=param.doc)
        box = gui.add_number(label, float(value), hint=f"{param.doc}; {param.range}", step=1e-6)

        shown = float(value)  # the last value that is allowed

        def on_slider(event: Untyped) -> None:
            nonlocal shown
            if event.client is not None:
                shown = box.value = scale.value(slider.value)
                change(name, shown)

        def on_number(event: Untyped) -> None:
            nonlocal shown
            if event.client is None:
                return
            if not param.allows(float(box.value)):
                box.value = shown
                return
            shown = float(box.value)
            slider.value = scale.notch(shown)
            change(name, shown)

        def show(new: float | bool) -> None:
            nonlocal shown
            shown = float(new)
            box.value, slider.value = shown, scale.notch(shown)

        slider.on_update(on_slider)
        box.on_update(on_number)
        self._setters[name] = show
