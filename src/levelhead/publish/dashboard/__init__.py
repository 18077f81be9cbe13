"""The page in the browser: ``levelhead view LOG``, ``levelhead view --live``, ``levelhead calibrate --live --view``.

A view answers calls by name and streams blocks of columns; ``server`` carries both over HTTP on 127.0.0.1. The page
itself is the folder ``web`` of the sources (TypeScript), built into ``publish/page`` by ``make page``.
"""
