"""Orientations in files: the columns of a log, and one segment of a file of several."""
