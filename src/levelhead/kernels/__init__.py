"""The scalar language: pure functions of floats and NamedTuples of floats, the only code that touches a sample.

A wrong size is a wrong type here (a ``Vec3`` has no ``.xx``), so it fails when a kernel is compiled, not when it runs.
"""
