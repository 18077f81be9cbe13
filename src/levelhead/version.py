"""The version, for whoever must not know the rest of the package."""

VERSION = "0.1.0"
