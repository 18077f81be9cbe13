"""The version, without an import of the rest of the package."""

VERSION = "0.1.0"
