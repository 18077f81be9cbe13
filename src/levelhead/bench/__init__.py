"""Levelhead beside its peers: errors on recordings with an optical reference, and time, measured side by side."""

from levelhead.bench.accuracy import Accuracy, accuracy
from levelhead.bench.methods import Method
from levelhead.bench.speed import Speed, speed

__all__ = ["Accuracy", "Method", "Speed", "accuracy", "speed"]
