"""Types that mypy cannot follow, one name for each kind of ``Any``."""

from collections.abc import Mapping
from typing import Any

JsonObject = dict[str, Any]  # a JSON object, a table's row, or keywords that are handed on: each value has its own type
ReadOnlyJson = Mapping[str, Any]  # the same, where nothing is added
Untyped = Any  # an object of a library that declares no types
