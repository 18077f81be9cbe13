"""Evaluation of an orientation: errors against truth as BROAD defines them, lag, error over σ, filters side by side."""

from levelhead.evaluate.align import Alignment, align
from levelhead.evaluate.attitude_error import Errors
from levelhead.evaluate.compare import Comparison, Row, compare
from levelhead.evaluate.reference import with_reference
from levelhead.evaluate.score import Score, error_angles, evaluate

__all__ = [
    "Alignment", "Comparison", "Errors", "Row", "Score", "align", "compare", "error_angles", "evaluate",
    "with_reference",
]  # fmt: skip
