"""Rows and tables of several sensors as one table."""
