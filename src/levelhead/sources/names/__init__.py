"""Words, units and axes in the names of columns."""
