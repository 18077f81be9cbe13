"""C functions that stand for Python's ``min`` and ``max``, whose results at ties and NaN differ from those of C's."""

_BODY = """static {kind} {name}({kind} a, {kind} b)
{{
    return b {sign} a ? b : a;
}}
"""
_FUNCTIONS = {
    "lh_min": ("{real}", "<"),
    "lh_max": ("{real}", ">"),
    "lh_min_int": ("int32_t", "<"),
    "lh_max_int": ("int32_t", ">"),
}


def helper_functions(code: str, real: str) -> list[str]:
    """Those that the code calls; ``real``: "double" or "float"."""
    return [
        _BODY.format(kind=kind.format(real=real), name=name, sign=sign)
        for name, (kind, sign) in _FUNCTIONS.items()
        if f"{name}(" in code
    ]
