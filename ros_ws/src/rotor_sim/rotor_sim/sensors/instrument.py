# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Sensors of the user's own: the base class, how a scenario names one, and their columns.

An instrument is found through the entry points of the group `rotor_rig.sensors`, or by
`module:Class`; docs/extending/sensor.md.
"""

import abc
import difflib
import inspect
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar

import numpy as np
import pydantic
from numpy.typing import NDArray

from rotor_common import plugins
from rotor_common.configuration import ConfigModel, tagged
from rotor_interfaces.channels import COLUMN_UNITS, channel_unit, is_channel
from rotor_interfaces.waveform import LONGEST_NAME, WAVEFORM_DTYPE
from rotor_sim.errors import RotorError

GROUP = 'rotor_rig.sensors'
"""The group of entry points."""

_RESERVED = {
    *('load_z', 'time_in_block', 'block_time', 'load_time', 'window_time'),
    *('window', 'valid', 'reason', 'alarm_level', 'alarm_reasons'),
}
"""Names in the results of `rotor_rig` that are not waveform columns."""


class Instrument(ConfigModel, abc.ABC):
    """Base of a user's sensor: a subclass defines parameters, columns and `measure`.

    Each run has its own copy, which may keep state in attributes like `_level: float = 0.0`.
    """

    columns: ClassVar[Mapping[str, str]] = {}
    """Unit of each new column by its name; a vibration channel ends in _y, _z, _ay or _az."""
    instrument: str
    """Name of the instrument in a scenario; each subclass has its own as default."""
    _rate_hz: int = 0
    _seed: int = 0

    @property
    def rate_hz(self) -> int:
        """Samples per second of the run."""
        return self._rate_hz

    @abc.abstractmethod
    def measure(self, rows: NDArray[np.void]) -> NDArray[np.float32]:
        """Return the new columns (n, k), float32, of the next block; NaN: no reading.

        `rows` (n,) are the true columns by name, read-only. Blocks come in order from sample 0 on,
        and the result must not depend on their length.
        """

    def normals(self, rows: NDArray[np.void], column: str) -> NDArray[np.float64]:
        """Return standard normal numbers (n,) for a column of this block.

        They depend on seed, column and sample only.
        """
        from rotor_sim.sensors import _kernels  # noqa: PLC0415 - numba is slow to import

        numbers = np.empty(len(rows))
        stream = zlib.crc32(column.encode())
        _kernels.normals(self._seed, stream, _kernels.INSTRUMENT, int(rows['sample'][0]), numbers)
        return numbers

    @classmethod
    def target(cls) -> str:
        """Return `module:Class` of this class."""
        return f'{cls.__module__}:{cls.__qualname__}'

    def for_run(self, rate_hz: int, seed: int) -> 'Instrument':
        """Return a copy that has measured nothing yet."""
        fresh = self.model_copy(deep=True)
        fresh._rate_hz, fresh._seed = rate_hz, seed  # noqa: SLF001 - of its own class
        return fresh

    def sample(self, rows: NDArray[np.void]) -> NDArray[np.float32]:
        """Return the result of `measure`; raises RotorError if it fails or has a wrong shape."""
        try:
            values: Any = self.measure(rows)
        except Exception as why:  # a user's class may raise anything
            at, kind = int(rows['sample'][0]), type(why).__name__
            raise RotorError(
                f'the instrument {self.instrument} fails at sample {at}: {kind}: {why}'
            ) from why
        wanted = len(rows), len(self.columns)
        if not isinstance(values, np.ndarray):
            got = f'a {type(values).__name__}'
        elif values.shape != wanted or values.dtype != np.float32:
            got = f'{values.dtype} of shape {values.shape}'
        else:
            return values
        raise RotorError(
            f'the instrument {self.instrument} gives {got}; it must be float32 of shape {wanted}'
        )


class Instruments:
    """The instruments of one run: they add their columns to the rows of each block."""

    def __init__(self, instruments: Sequence[Instrument], rate_hz: int, seed: int) -> None:
        self._instruments = [instrument.for_run(rate_hz, seed) for instrument in instruments]
        new = [(name, '<f4') for instrument in instruments for name in instrument.columns]
        self._dtype = np.dtype([*WAVEFORM_DTYPE.descr, *new])

    def widen(self, rows: NDArray[np.void], truth_rows: NDArray[np.void]) -> NDArray[np.void]:
        """Return `rows` with the instruments' columns added; `rows` itself without instruments."""
        if not self._instruments:
            return rows
        true = truth_rows.view()
        true.flags.writeable = False
        wide = np.empty(len(rows), self._dtype)
        for name in WAVEFORM_DTYPE.names or ():
            wide[name] = rows[name]
        for instrument in self._instruments:
            for name, values in zip(instrument.columns, instrument.sample(true).T, strict=True):
                wide[name] = values
        return wide


def find_instrument(name: Any) -> type[Instrument]:
    """Return the class of an instrument by its installed name, or by `module:Class`.

    Raises RotorError if there is none, it cannot be loaded, or it is no instrument.
    """
    target = plugins.target_of(name, GROUP) if isinstance(name, str) else None
    if target is None:
        known = plugins.names_of(GROUP)
        close = difflib.get_close_matches(str(name), known, n=1)
        installed = f'installed: {", ".join(known) or "none"}; others are named module:Class'
        hint = f'did you mean {close[0]!r}?' if close else installed
        raise RotorError(f'instrument = {name!r} is not known here; {hint}')
    made = plugins.load_from_here(target, 'instrument =', RotorError)
    if not isinstance(made, type) or not issubclass(made, Instrument) or inspect.isabstract(made):
        raise RotorError(
            f'instrument = {name!r} is no instrument: {target} must be a class that derives from '
            'rotor_sim.sensors.Instrument and has measure'
        )
    if name not in (made.target(), made.model_fields['instrument'].default):
        raise RotorError(
            f'{name!r} leads to {made.target()}; write that, or register it under its name'
        )
    return made


def check_columns(instruments: Sequence[Instrument]) -> None:
    """Raise RotorError for missing or invalid columns, and for names that are already in use."""
    taken = {*COLUMN_UNITS}
    for instrument in instruments:
        who = f'the instrument {instrument.instrument}'
        columns = instrument.columns
        if not isinstance(columns, Mapping) or not columns:
            raise RotorError(f'{who} has no columns; they are a mapping of names to units')
        for name, unit in columns.items():
            if not isinstance(name, str) or not re.fullmatch(r'[A-Za-z]\w*', name, re.ASCII):
                raise RotorError(f'{who}: column {name!r} must be letters, digits and _')
            if not isinstance(unit, str) or not unit or max(len(name), len(unit)) > LONGEST_NAME:
                raise RotorError(f'{who}: column {name!r} must have a unit, a text such as m/s')
            if name in _RESERVED or name.startswith(('truth_', 'load_grid_')):
                raise RotorError(f'{who}: the name {name!r} is reserved; name the column otherwise')
            if name in taken:
                raise RotorError(f'{who}: there is a column {name!r} already; name it otherwise')
            if is_channel(name) and unit != channel_unit(name):
                raise RotorError(
                    f'{who}: column {name!r} has the name of a vibration channel in '
                    f'{channel_unit(name)}, but is in {unit}; name it otherwise'
                )
            taken.add(name)


def _read(value: Any, info: pydantic.ValidationInfo) -> Any:
    """Return the instrument that plain data, or a name alone, describe."""
    if isinstance(value, Instrument):
        return value
    if isinstance(value, str):
        value = {'instrument': value}
    if not isinstance(value, Mapping) or 'instrument' not in value:
        raise RotorError('an instrument is a name, or a mapping with the key instrument')
    adapter = tagged(find_instrument(value['instrument']))
    if info.mode == 'json':  # JSON arrays are valid tuples
        return adapter.validate_json(json.dumps(value))
    return adapter.validate_python(value)


InstrumentConfig = Annotated[pydantic.SerializeAsAny[Instrument], pydantic.BeforeValidator(_read)]
"""Type of a model's field that holds an instrument."""
