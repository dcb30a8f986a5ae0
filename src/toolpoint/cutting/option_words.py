"""A cut as the options of a command, in the units that they take."""

from __future__ import annotations

from toolpoint.cutting.description import PARAMETERS, SI_VALUE, CuttingDescription, flat_values


def cut_words(cut: CuttingDescription) -> list[str]:
    """Return a cut as the options that commands about cuts take (``--diameter 16``), in their units."""
    words: list[str] = []
    for key, value in flat_values(cut).items():
        parameter = PARAMETERS.get(key)
        if parameter is None or not parameter.option or value in (None, "", ()) or parameter.kind == "variation":
            continue
        numbers = value if isinstance(value, tuple) else (value,)
        scale = SI_VALUE.get(parameter.unit, 1.0)
        is_word = parameter.kind in ("count", "choice", "text")
        texts = [str(number) if is_word else f"{number / scale:.9g}" for number in numbers]
        words += [f"--{parameter.option}", ",".join(texts)]
    return words
