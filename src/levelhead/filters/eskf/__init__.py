"""ESKF: the filter that calibrates its sensor while it runs."""

from levelhead.filters.eskf.filter import FILTER
from levelhead.filters.eskf.params import ESKF

__all__ = ["ESKF", "FILTER"]
