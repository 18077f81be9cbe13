"""Filters as C99: the kernels translated, with the numbers that were found, and what a board needs around them."""

from levelhead.export.config import ExportConfig
from levelhead.export.project import files, write, write_package

__all__ = ["ExportConfig", "files", "write", "write_package"]
