"""Text: files of lines, each dialect in a module."""
