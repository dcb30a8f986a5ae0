"""C text of NumPy records: struct definitions, enumerations and constant values, so that C reads the same fields by name."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from toolpoint._check import fail

_TYPES = {"f": "double", "i": "long long"}


def struct_text(name: str, dtype: np.dtype[np.void]) -> str:
    """Return the C struct of a record type, field by field; all fields have eight bytes, so nothing is padded."""
    lines = []
    for field in dtype.names or ():
        kind, shape = dtype[field].base, dtype[field].shape
        if kind.itemsize != 8 or kind.kind not in _TYPES:
            fail(f"{name}.{field}", str(kind), "must be a number of eight bytes")
        lines.append(f"    {_TYPES[kind.kind]} {field}{''.join(f'[{n}]' for n in shape)};")
    return "typedef struct {\n" + "\n".join(lines) + f"\n}} {name};\n"


def enum_text(prefix: str, names: Iterable[str], total: str = "") -> str:
    """Return the C enumeration of names in their order, and their number under the name `total`."""
    words = [*(prefix + name for name in names), *([total] if total else [])]
    return "enum { " + ", ".join(words) + " };\n"


def values_text(array: np.ndarray) -> str:
    """Return the C initializer of an array of numbers or records, a line for every six numbers or for each record."""
    if array.dtype.names:
        return "{" + ",\n".join(_record(record) for record in array) + "}" if array.size else "{{0}}"
    numbers = [_number(v) for v in array.ravel().tolist()]
    return "{" + ",\n".join(", ".join(numbers[i:i + 6]) for i in range(0, len(numbers), 6)) + "}" if numbers else "{0}"


def _record(record: np.void) -> str:
    return "{" + ", ".join(f".{name} = {_nested(np.asarray(record[name]).tolist())}" for name in record.dtype.names or ()) + "}"


def _nested(value: object) -> str:
    if isinstance(value, list):
        return "{" + ", ".join(_nested(part) for part in value) + "}"
    return _number(value)


def _number(value: object) -> str:
    return "INFINITY" if value == np.inf else repr(value)
