"""Columns of a file as a Record: what each channel measures, where, and how many SI units its samples are."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import cast

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.io.binary.wav import FULL_SCALE
from toolpoint.io.measured.name_patterns import dof_of
from toolpoint.io.quantities.sensitivities import QUANTITY_BY_UNIT, VOLTS, parse_sensitivity
from toolpoint.io.text.columns import Columns
from toolpoint.signals.test_description import ChannelDescription, Motion
from toolpoint.vibration import Dof, Record

MOTIONS = ("force", "acceleration", "velocity", "displacement")
# Names of channels as analysers write them in English and German; f, a and v alone only where nothing else stands.
_WORDS = {"force": r"\bforce\b|hammer|\bkraft\b|^f[xyz]?$", "acceleration": r"acc|beschl|^a[xyz]?$",
          "velocity": r"\bvel|\bv[xyz]$|vibrometer", "displacement": r"\bdisp|\bweg\b"}
_LABEL_PATTERN = re.compile(rf"(?:(?P<quantity>{'|'.join(MOTIONS)})\s+)?(?P<dof>\S+:[-+]?r?[xyz])", re.IGNORECASE)
FORM = "write CHANNEL=QUANTITY DOF SENSITIVITY, for example '1=force 5:-z 2.25mV/N' or 'acc 1=acceleration tip:+x 100mV/g'"


@dataclass
class Labels:
    """Assumptions made while records are labelled, each remark once."""

    notes: list[str] = field(default_factory=list)

    def note(self, text: str) -> None:
        """Keep a remark."""
        if text not in self.notes:
            self.notes.append(text)


@dataclass(frozen=True)
class _Channel:
    """One channel as far as the file or its user says: quantity, Dof, and SI units in one unit of the file."""

    name: str
    quantity: str | None
    dof: Dof | None
    factor: float


def parse_channel(text: str) -> ChannelDescription:
    """Return the description of a text such as ``1=force 5:-z 2.25mV/N``: quantity, Dof, sensitivity, mass of the sensor
    (``10g``) and full scale of a sound file (``10V``) in any order, none or all; ``1=ignored`` leaves a channel out."""
    name, equals, description = text.partition("=")
    words = description.replace(",", " ").split()
    if not equals or not name.strip() or not words:
        raise ToolpointError(f"`channel` {text!r}: {FORM}")
    described = ChannelDescription(name.strip())
    for word in _joined(words):
        if word.lower() in (*MOTIONS, "ignored"):
            described = replace(described, quantity=cast(Motion, word.lower()))
        elif "/" in word:
            described = replace(described, sensitivity=word)
        elif full := re.fullmatch(r"([\d.]+(?:[eE][-+]?\d+)?)(m?V)", word):
            described = replace(described, full_scale=float(full[1]) * VOLTS[full[2].lower()])
        elif mass := re.fullmatch(r"([\d.]+)(k?g)", word):
            described = replace(described, mass=float(mass[1]) * (1.0 if mass[2] == "kg" else 1e-3))
        elif re.fullmatch(r"\S+:[-+]?r?[xyz]", word, re.IGNORECASE):
            described = replace(described, dof=word)
        else:
            raise ToolpointError(f"`channel` {text!r}: {word!r} is no quantity ({', '.join(MOTIONS)}, ignored), no Dof (5:-z), "
                                 f"no sensitivity (100mV/g) and no full scale of a sound file (10V); {FORM}")
    return described


def _joined(words: Sequence[str]) -> list[str]:
    """Return the words with a number and the unit behind it as one."""
    result: list[str] = []
    for word in words:
        if result and re.fullmatch(r"[-+]?[\d.eE+-]+", result[-1]) and ("/" in word or word in ("V", "mV")):
            result[-1] += word
        else:
            result.append(word)
    return result


def label_columns(path: Path, columns: Columns, channels: Sequence[ChannelDescription], *, labels: Labels) -> Record:
    """Return columns as a record in SI; a channel that is no force and no motion is left out, and said.

    Raises ToolpointError for a channel that is not there, volts without sensitivity, quantities that cannot be told.
    """
    described = _matched(path, columns.names, channels)
    labelled = [_channel(path, name, unit, described.get(k), labels)
                for k, (name, unit) in enumerate(zip(columns.names, columns.units, strict=True))]
    kept = [k for k, channel in enumerate(labelled) if channel.quantity in MOTIONS]
    if not kept:
        listed = ", ".join(f"{k + 1}: {name} [{unit or 'no unit'}]"
                           for k, (name, unit) in enumerate(zip(columns.names, columns.units, strict=True)))
        sound = "; a microphone measures no force: `toolpoint listen` judges the sound of a cut" * (
            set(columns.units) == {"full scale"})
        raise ToolpointError(f"{path}: no channel is known as force or motion ({listed}); say what each is with `channel`: "
                             f"{FORM}{sound}")
    omitted = [labelled[k].name for k in range(len(labelled)) if k not in kept and labelled[k].quantity != "ignored"]
    if omitted:
        labels.note(f"channels left out, as nothing says what they measure: {', '.join(omitted)}")
    if columns.sample_rate is None:
        raise ToolpointError(f"{path}: no sample rate and no first column 'time'; give the rate with `rate`, Hz")
    factors: FloatArray = np.array([labelled[k].factor for k in kept])
    return Record(columns.samples[:, kept] * factors, columns.sample_rate, _dofs([labelled[k] for k in kept], labels),
                  tuple(str(labelled[k].quantity) for k in kept), start=columns.start, name=path.name)


def label_record(path: Path, record: Record, channels: Sequence[ChannelDescription], *, labels: Labels) -> Record:
    """Return a record that has labels, with those of described channels in their place; sensitivities divide its samples."""
    names = [f"{quantity} {dof}" for quantity, dof in zip(record.quantities, record.channels, strict=True)]
    described = _matched(path, names, channels)
    dofs, kinds, factors, kept = list(record.channels), list(record.quantities), np.ones(len(names)), list(range(len(names)))
    for k, channel in described.items():
        labelled = _channel(path, names[k], _unit_of(record, k), channel, labels)
        dofs[k], factors[k] = labelled.dof or dofs[k], labelled.factor
        kinds[k] = labelled.quantity or kinds[k]
    kept = [k for k in kept if kinds[k] in MOTIONS]
    volts = [names[k] for k in range(len(names)) if kinds[k] not in (*MOTIONS, "ignored")]
    if volts:
        labels.note(f"channels left out, as nothing says what they measure: {', '.join(volts)}")
    if not kept:
        raise ToolpointError(f"{path}: no channel is known as force or motion ({', '.join(names)}); {FORM}")
    return Record(record.samples[:, kept] * factors[kept], record.sample_rate, tuple(dofs[k] for k in kept),
                  tuple(kinds[k] for k in kept), start=record.start, name=record.name or path.name)


def _unit_of(record: Record, k: int) -> str:
    return record.units[k] or ("V" if record.quantities[k] in ("voltage", "unknown") else "")


def _matched(path: Path, names: Sequence[str], channels: Sequence[ChannelDescription]) -> dict[int, ChannelDescription]:
    """Return the described channels by their place; by name first, then by number."""
    result: dict[int, ChannelDescription] = {}
    lower = [name.lower() for name in names]
    for channel in channels:
        key = channel.channel.strip().lower()
        # By name before number: channels may be called 1, 2, 3 in another order than they stand in.
        if key in lower:
            place = lower.index(key)
        elif key.isdigit() and 1 <= int(key) <= len(names):
            place = int(key) - 1
        else:
            raise ToolpointError(f"{path}: no channel {channel.channel!r}; it holds "
                                 + ", ".join(f"{k + 1}: {name}" for k, name in enumerate(names)))
        if place in result:
            raise ToolpointError(f"`channel` {channel.channel}: channel {names[place]!r} is described twice; keep one of both")
        result[place] = channel
    return result


def _channel(path: Path, name: str, unit: str, described: ChannelDescription | None, labels: Labels) -> _Channel:
    stated = _LABEL_PATTERN.fullmatch(name.strip())
    dof = dof_of(described.dof) if described and described.dof else dof_of(stated["dof"]) if stated else None
    by_unit, scale = QUANTITY_BY_UNIT.get(unit.strip().lower(), (None, 1.0))
    quantity = (described.quantity if described and described.quantity else
                stated["quantity"].lower() if stated and stated["quantity"] else by_unit or _by_name(name))
    if described and described.sensitivity is not None:
        factor, quantity = _of_sensitivity(path, name, unit, described, quantity)
        return _Channel(name, quantity, dof, factor)
    if quantity in MOTIONS and (unit.strip().lower() in VOLTS or unit == FULL_SCALE):
        raise ToolpointError(f"{path}: channel {name!r} ({quantity}) is in {unit} and has no sensitivity; give it with "
                             f"`channel`, for example '{name}={quantity} {'2.25mV/N' if quantity == 'force' else '100mV/g'}'")
    # A force in m/s^2 is a swapped cable or a wrong line of the test file: read either way, the result would look
    # plausible.
    if by_unit is not None and quantity != by_unit and quantity in MOTIONS:
        raise ToolpointError(f"{path}: channel {name!r} is in {unit}, which is {by_unit}, and is called {quantity}; correct "
                             "one of both")
    if quantity in MOTIONS and by_unit is None:
        labels.note(f"{name}: no unit is stated; its samples are taken as SI ({Record.SI[str(quantity)]})")
    return _Channel(name, quantity, dof, scale)


def guess_quantity(name: str, unit: str) -> str | None:
    """Return what a channel measures by its unit, else by its name; None where neither says it.

    >>> guess_quantity("Hammer", "V"), guess_quantity("data 1", "")
    ('force', None)
    """
    by_unit, _ = QUANTITY_BY_UNIT.get(unit.strip().lower(), (None, 1.0))
    return by_unit or _by_name(name)


def _by_name(name: str) -> str | None:
    return next((quantity for quantity, words in _WORDS.items() if re.search(words, name, re.IGNORECASE)), None)


def _of_sensitivity(path: Path, name: str, unit: str, described: ChannelDescription, quantity: str | None
                    ) -> tuple[float, str | None]:
    """Return SI units in one unit of the file, and the quantity, from a sensitivity."""
    value = described.sensitivity
    try:
        volts_each, motion = parse_sensitivity(str(value)) if isinstance(value, str) else (float(value or 0.0), quantity)
    except ValueError as error:
        raise ToolpointError(f"`channel` {name}: {error}") from None
    if volts_each == 0:
        raise ToolpointError(f"`channel` {name}: sensitivity 0; must not be zero")
    if described.quantity is not None and motion != described.quantity:
        raise ToolpointError(f"`channel` {name}: a sensitivity of {value} is that of a sensor of {motion}, and the channel is "
                             f"called {described.quantity}; channels may be swapped")
    if unit == FULL_SCALE and described.full_scale is None:
        raise ToolpointError(f"{path}: channel {name!r} of a sound file holds shares of the full scale; add the volts of full "
                             f"scale: '{name}={quantity or 'acceleration'} {value} 10V', or full_scale: 10 V in a test file")
    volts = described.full_scale if unit == FULL_SCALE else VOLTS.get(unit.strip().lower(), 1.0 if not unit else None)
    if volts is None:
        raise ToolpointError(f"{path}: channel {name!r} is in {unit} and needs no sensitivity; leave it out")
    return float(volts) / volts_each, motion


def _dofs(channels: Sequence[_Channel], labels: Labels) -> tuple[Dof, ...]:
    """Return a Dof for every channel: those that are stated; else points 1, 2 .. along +x, the force at the first motion's."""
    taken = {channel.dof.point for channel in channels if channel.dof is not None}
    free = (number for number in range(1, 10_000) if number not in taken)
    motions = [Dof(next(free), "+x") if channel.dof is None else channel.dof for channel in channels
               if channel.quantity != "force"]
    if any(channel.dof is None for channel in channels if channel.quantity != "force"):
        labels.note("the files do not say where sensors stand: they are taken as points 1, 2 .. along +x in their order")
    places = iter(motions)
    result = []
    for channel in channels:
        if channel.quantity != "force":
            result.append(next(places))
        elif channel.dof is not None:
            result.append(channel.dof)
        else:
            # The commonest test has one sensor and blows beside it: so it is taken, and noted.
            result.append(motions[0] if motions else Dof(1, "+x"))
            labels.note(f"nothing says where the hammer struck: it is taken as {result[-1]}, the place of the first sensor")
    return tuple(result)
