"""Plain data of a step as JSON, the same bytes for the same numbers."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

JSON_DIGITS = 9  # significant digits: what threads and libraries may round differently lies below


def write_json(path: Path, data: Any) -> None:
    """Write plain data; numbers are rounded to 9 digits, those that JSON lacks become null."""
    path.write_text(json.dumps(plain(data), indent=1) + "\n", encoding="utf-8")


def read_json(path: Path) -> Any:
    """Return the data of a JSON file."""
    return json.loads(path.read_text(encoding="utf-8"))


def plain(data: Any) -> Any:
    """Return data as JSON holds it."""
    if isinstance(data, dict):
        return {str(key): plain(value) for key, value in data.items()}
    if isinstance(data, (list, tuple)):
        return [plain(value) for value in data]
    if isinstance(data, np.ndarray):
        return plain(data.tolist())
    if isinstance(data, (bool, np.bool_)):
        return bool(data)
    if isinstance(data, (int, np.integer)):
        return int(data)
    if isinstance(data, (float, np.floating)):
        return float(f"{data:.{JSON_DIGITS}g}") if math.isfinite(data) else None
    return data if data is None else str(data)
