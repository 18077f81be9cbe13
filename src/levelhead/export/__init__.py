"""Filters as C99: the kernels translated, with the numbers found, and the files that a board needs."""

from levelhead.export.config import ExportConfig
from levelhead.export.project import files, write, write_package

__all__ = ["ExportConfig", "files", "write", "write_package"]
