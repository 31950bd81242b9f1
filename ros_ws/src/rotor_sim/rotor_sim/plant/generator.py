# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Writes the compiled engine of a plant: one flat module for its degrees of freedom and elements.

The module integrates L rotors side by side in SIMD lanes with classical RK4, in time (streams) or
over whole revolutions (analyses), there with tangents if asked for. L is known to the compiler as
the length of a tuple. Layout: one flat buffer, `b[row * L + lane]`; only so (one buffer, one loop
over lanes with everything inlined) does LLVM vectorise. No fastmath: nothing is reassociated or
contracted, so a lane has the same bits alone and among others, with and without its tangent.
"""

import inspect
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_sim.errors import PlantError
from rotor_sim.plant.element import TRANSLATIONS
from rotor_sim.plant.force_source import Names, Term, Writer, follow
from rotor_sim.plant.plant import Assembly, PlacedElement

Array = NDArray[np.float64]

_LINEAR = ('stiffness', 'stiffness_per_speed', 'damping', 'damping_per_speed')


@dataclass(frozen=True)
class Engine:
    """The text of a module and what has to be given to it.

    `coefficients` names the rows in order; `live` are (element, field) of the drive's columns.
    """

    text: str
    coefficients: tuple[str, ...]
    live: tuple[tuple[str, str], ...]
    switches: int
    rows: '_Layout'


def linear_rows(assembly: Assembly) -> dict[str, float]:
    """Return the numbers of the linear part by the names of their rows.

    M^-1 of each matrix where it may differ from 0, of the load, and of what forces act on.
    """
    linear, n = assembly.linear, assembly.size
    inverse = np.linalg.inv(linear.mass)
    rows: dict[str, float] = {}
    for name in _LINEAR:
        product = inverse @ getattr(linear, name)
        for j, k in zip(*np.nonzero(_pattern(inverse, linear.patterns[name])), strict=True):
            _put(rows, _row(name, assembly, int(j), int(k)), float(product[j, k]))
    for k, axis in enumerate(TRANSLATIONS):
        product = inverse @ linear.load[:, k]
        for j in range(n):
            if product[j] != 0.0:
                row = f'load_{axis}[{assembly.canonical[j]}]'
                _put(rows, row, float(product[j]))
    for j, k in zip(*np.nonzero(inverse), strict=True):
        row = _row('inverse_mass', assembly, int(j), int(k))
        _put(rows, row, float(inverse[j, k]))
    return rows


def _pattern(inverse: Array, pattern: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return where `inverse` times a matrix of this pattern may differ from 0."""
    return np.asarray((inverse != 0.0).astype(float) @ pattern.astype(float) > 0.0)


def _put(rows: dict[str, float], name: str, value: float) -> None:
    before = rows.setdefault(name, value)
    if abs(before - value) > 1e-12 * abs(value):
        raise PlantError(
            f'twins are not alike: {name} is {before:g} for one and {value:g} for the other; '
            'give both nodes the same elements, or take the pair out of twins'
        )


def _row(name: str, assembly: Assembly, j: int, k: int) -> str:
    """Return the name of a row: twins share theirs, so that the compiler sees equal values."""
    a, b = assembly.canonical[j], assembly.canonical[k]
    twinned = {*assembly.canonical} - {
        c for c in assembly.canonical if assembly.canonical.count(c) == 1
    }
    is_across = a in twinned and b in twinned and (a == j) != (b == k)
    return f'{name}[{a},{"other " if is_across else ""}{b}]'


def coefficients(assembly: Assembly) -> dict[str, float]:
    """Return all numbers of a plant by the names of their rows."""
    rows = linear_rows(assembly)
    for place, each in enumerate(assembly.elements):
        if each.like != place or each.element.force is None:
            continue
        for name, value in each.element.coefficients().items():
            if isinstance(value, tuple):
                rows |= {f'{each.name}.{name}[{k}]': one for k, one in enumerate(value)}
            else:
                rows[f'{each.name}.{name}'] = value
    return rows


@dataclass(frozen=True)
class Record:
    """A quantity that a stream samples beside the displacements.

    `what` is 'acceleration' of the degree of freedom `place`; 'load' along y (0) or z (1), m/s^2;
    or 'force' of `element` on the `place`-th degree of freedom that it touches, N.
    """

    what: str
    place: int
    element: str = ''


class _Layout:
    """Rows of the buffer; those of a plant's coefficients come last."""

    def __init__(self, n: int, rotations: int, live: int, records: int, switches: int) -> None:
        self.state = 0
        self.tangent = 2 * n
        self.angles = 4 * n
        """cos and sin of each rotation."""
        self.load = self.angles + 2 * rotations
        """y and z at the start, the middle and the end of a step."""
        self.drive = self.load + 6
        """Speed and its increment over a sample, then those of each live parameter."""
        self.records = self.drive + 2 + 2 * live
        self.sides = self.records + records
        """Sides of the surfaces on which the state stands, then those after a step."""
        self.ratios = self.sides + 2 * switches
        """Of each rotation to the shaft."""
        self.half_turns = self.ratios + rotations
        """cos and sin of what each rotation turns in half a step."""
        self.step = self.half_turns + 2 * rotations
        """Length of a step, s; only over whole revolutions."""
        self.coefficients = self.step + 1


def rotations_of(assembly: Assembly) -> tuple[dict[str, int], tuple[float, ...]]:
    """Return the index of each rotation, `shaft` or `element.name`, and the ratios to the shaft.

    What turns at the same ratio is one rotation.
    """
    ratios = {'shaft': 1.0}
    for place, each in enumerate(assembly.elements):
        if each.like == place:
            ratios |= {f'{each.name}.{k}': r for k, r in each.element.rotations().items()}
    places: dict[float, int] = {}
    index = {key: places.setdefault(ratio, len(places)) for key, ratio in ratios.items()}
    return index, tuple(places)


def structure_of(assembly: Assembly, records: Sequence[Record]) -> object:
    """Return what decides the text of an engine: plants that agree in it share the text."""
    elements = tuple(
        (
            each.name,
            type(each.element),
            tuple(sorted(each.element.structure().items())),
            each.places,
            each.like,
            tuple(
                (name, len(value) if isinstance(value, tuple) else 0)
                for name, value in each.element.coefficients().items()
            ),
        )
        for each in assembly.elements
    )
    return (
        assembly.coordinates,
        assembly.canonical,
        elements,
        tuple(rotations_of(assembly)[0].items()),
        tuple(linear_rows(assembly)),
        tuple(records),
    )


def write(assembly: Assembly, records: Sequence[Record] = ()) -> Engine:
    """Write the engine of a plant that samples `records` beside the displacements.

    Raises PlantError for an element whose force cannot be compiled.
    """
    return _EngineWriter(assembly, records).engine()


def _tuple(names: Sequence[str]) -> str:
    return f'({", ".join(names)},)' if names else '()'


def _indented(lines: Sequence[str], by: int = 4) -> str:
    return '\n'.join(' ' * by + line for line in lines)


class _EngineWriter:
    """Writes the module of one plant."""

    def __init__(self, assembly: Assembly, records: Sequence[Record]) -> None:
        self._assembly, self._records = assembly, records
        self._values = coefficients(assembly)
        own = [each for k, each in enumerate(assembly.elements) if each.like == k]
        self._rotation, self._ratios = rotations_of(assembly)
        self._live = [(e.name, k) for e in own if e.element.force for k in e.element.live]
        inverse, patterns = np.linalg.inv(assembly.linear.mass), assembly.linear.patterns
        self._patterns = {name: _pattern(inverse, patterns[name]) for name in _LINEAR}
        n = assembly.size
        self._names = list(self._values)
        self._rows = _Layout(n, len(self._ratios), len(self._live), len(records), 0)
        self._switches = len(self._switch_terms(Writer(tangent=False)))
        self._rows = _Layout(n, len(self._ratios), len(self._live), len(records), self._switches)

    def engine(self) -> Engine:
        return Engine(
            self._text(),
            tuple(self._names),
            tuple(self._live),
            self._switches,
            self._rows,
        )

    def _coefficient(self, name: str) -> str:
        return f'b[i + {self._rows.coefficients + self._names.index(name)} * L]'

    def _arguments(
        self,
        each: PlacedElement,
        writer: Writer,
        *,
        turning: bool = False,
        for_switches: bool = False,
    ) -> dict[str, Any]:
        """Return what the functions of an element may take: x, v, p, d, s.

        The numbers p are read before anything else: a read inside a choice stops vectorisation.
        """
        own = self._assembly.elements[each.like]
        x = tuple(0.0 if k is None else Term(f'x{k}', f'dx{k}') for k in each.places)
        v = tuple(0.0 if k is None else Term(f'v{k}', f'dv{k}') for k in each.places)
        numbers: dict[str, Any] = {}
        for name, value in own.element.coefficients().items():
            if isinstance(value, tuple):
                numbers[name] = tuple(
                    writer.new(self._coefficient(f'{own.name}.{name}[{k}]'))
                    for k in range(len(value))
                )
            else:
                numbers[name] = writer.new(self._coefficient(f'{own.name}.{name}'))
        for name in own.element.live:
            numbers[name] = Term(f'live{self._live.index((own.name, name))}')
        drive: dict[str, Any] = {
            'speed_rad_s': Term('speed'),
            'acceleration_rad_s2': Term('slope'),
        }
        if not for_switches:
            drive |= {'load_y_m_s2': Term('load_y'), 'load_z_m_s2': Term('load_z')}
        for suffix, key in (
            ('', 'shaft'),
            *((f'_{name}', f'{own.name}.{name}') for name in own.element.rotations()),
        ):
            k = self._rotation[key]
            drive[f'cos{suffix}'] = Term(f'c{k}', f'dc{k}' if turning else None)
            drive[f'sin{suffix}'] = Term(f's{k}', f'ds{k}' if turning else None)
        structure = dict(own.element.structure())
        return {
            'x': x,
            'v': v,
            'p': Names(f'the numbers p of {each.element.kind}', numbers),
            'd': Names('the drive d', drive),
            's': Names(f'the structure s of {each.element.kind}', structure),
        }

    def _follow(
        self, function: Any, each: PlacedElement, writer: Writer, *, turning: bool = False
    ) -> tuple[Any, ...]:
        who = f'element {each.name} ({each.element.kind})'
        is_force = function is each.element.force
        offered = self._arguments(each, writer, turning=turning, for_switches=not is_force)
        wanted = tuple(inspect.signature(function).parameters)
        if unknown := set(wanted) - offered.keys():
            raise PlantError(
                f'{who}: {function.__qualname__} takes {min(unknown)}; it may take '
                f'{", ".join(offered)}'
            )
        return follow(function, [offered[name] for name in wanted], writer, who)

    def _switch_terms(self, writer: Writer, *, turning: bool = False) -> list[Term]:
        terms: list[Term] = []
        for each in self._assembly.elements:
            if each.element.switches is not None:
                terms += self._follow(each.element.switches, each, writer, turning=turning)
        return terms

    def _accelerations(self, writer: Writer) -> tuple[list[Term], list[Term]]:
        """Write eq. (5) of this plant; return the accelerations and the records."""
        assembly = self._assembly
        pushed: dict[int, list[Term]] = {}
        forces: dict[str, tuple[Term, ...]] = {}
        for each in assembly.elements:
            if each.element.force is None:
                continue
            writer.lines.append(f'# {each.name}: {each.element.kind}')
            found = self._follow(each.element.force, each, writer)
            if len(found) != len(each.places):
                raise PlantError(
                    f'element {each.name} ({each.element.kind}): its force returns {len(found)} '
                    f'numbers, but it touches {len(each.places)} degrees of freedom'
                )
            found = tuple(self._as_term(each, force) for force in found)
            forces[each.name] = found
            for place, force in zip(each.places, found, strict=True):
                if place is not None and force.text != '0.0':
                    pushed.setdefault(place, []).append(force)
        writer.lines.append('# accelerations')
        total = {k: self._sum(writer, terms) for k, terms in pushed.items()}
        found_a = [self._acceleration(writer, j, total) for j in range(assembly.size)]
        records = []
        for record in self._records:
            match record.what:
                case 'acceleration':
                    records.append(Term(found_a[record.place].text))
                case 'load':
                    records.append(Term(('load_y', 'load_z')[record.place]))
                case _:
                    records.append(forces[record.element][record.place])
        return found_a, records

    @staticmethod
    def _as_term(each: PlacedElement, force: Any) -> Term:
        if isinstance(force, Term):
            return force
        if isinstance(force, int | float) and math.isfinite(force):
            return Term(repr(float(force)))
        raise PlantError(
            f'element {each.name} ({each.element.kind}): its force returns {force!r}, not a number'
        )

    @staticmethod
    def _sum(writer: Writer, terms: Sequence[Term]) -> Term:
        if len(terms) == 1:
            return terms[0]
        changes = [term.change for term in terms if term.change]
        return writer.new(' + '.join(t.text for t in terms), ' + '.join(changes) or None)

    def _acceleration(self, writer: Writer, j: int, total: dict[int, Term]) -> Term:
        assembly, canonical = self._assembly, self._assembly.canonical
        order = sorted(range(assembly.size), key=lambda k: (canonical[k], k))
        parts, changes = [], []
        for axis in TRANSLATIONS:
            name = f'load_{axis}[{canonical[j]}]'
            if name in self._values:
                parts.append(f'{self._coefficient(name)} * load_{axis}')
        for k in order:
            name = _row('inverse_mass', assembly, j, k)
            if k in total and name in self._values:
                parts.append(f'{self._coefficient(name)} * {total[k].text}')
                if total[k].change:
                    changes.append(f'{self._coefficient(name)} * {total[k].change}')
        text, change = ' + '.join(parts) or '0.0', ' + '.join(changes)
        for matrix, factor, of in (
            ('stiffness', '', 'x'),
            ('stiffness_per_speed', 'speed * ', 'x'),
            ('damping', '', 'v'),
            ('damping_per_speed', 'speed * ', 'v'),
        ):
            rows = [(_row(matrix, assembly, j, k), k) for k in order]
            there = [(self._coefficient(row), k) for row, k in rows if self._patterns[matrix][j, k]]
            if there:
                text += f' - {factor}({" + ".join(f"{row} * {of}{k}" for row, k in there)})'
                change += f' - {factor}({" + ".join(f"{row} * d{of}{k}" for row, k in there)})'
        return writer.new(text, change or None)

    def _unpacked(self) -> list[str]:
        """Return the lines that name the arguments of the equations."""
        n, r = self._assembly.size, len(self._ratios)
        return [
            f'{_tuple([f"x{k}" for k in range(n)])} = x',
            f'{_tuple([f"v{k}" for k in range(n)])} = v',
            f'{_tuple([f"{a}{k}" for k in range(r) for a in "cs"])} = turns',
            f'{_tuple(["speed", "slope", *(f"live{k}" for k in range(len(self._live)))])} = drive',
        ]

    def _changes_unpacked(self) -> list[str]:
        n = self._assembly.size
        return [
            f'{_tuple([f"dx{k}" for k in range(n)])} = dx',
            f'{_tuple([f"dv{k}" for k in range(n)])} = dv',
        ]

    def _equations(self) -> str:
        plain, dual = Writer(tangent=False), Writer(tangent=True)
        found, records = self._accelerations(plain)
        twice, _ = self._accelerations(dual)
        text = f"""
@inline
def acceleration(b, i, L, x, v, turns, drive, load):
{_indented(self._unpacked())}
    load_y, load_z = load
{_indented(plain.lines)}
    return {_tuple([a.text for a in found])}, {_tuple([r.text for r in records])}


@inline
def acceleration_tangent(b, i, L, x, v, dx, dv, turns, drive, load):
{_indented(self._unpacked() + self._changes_unpacked())}
    load_y, load_z = load
{_indented(dual.lines)}
    return {_tuple([a.text for a in twice])}, {_tuple([a.change or '0.0' for a in twice])}
"""
        if not self._switches:
            return text
        plain, dual = Writer(tangent=False), Writer(tangent=True)
        terms, rates = self._switch_terms(plain), self._switch_terms(dual, turning=True)
        r = range(len(self._ratios))
        return f"""{text}

@inline
def switches(b, i, L, x, v, turns, drive):
{_indented(self._unpacked())}
{_indented(plain.lines)}
    return {_tuple([t.text for t in terms])}


@inline
def switch_rates(b, i, L, x, v, dx, dv, turns, dturns, drive):
{_indented(self._unpacked() + self._changes_unpacked())}
    {_tuple([f'd{a}{k}' for k in r for a in 'cs'])} = dturns
{_indented(dual.lines)}
    return {_tuple([t.text for t in rates])}, {_tuple([t.change or '0.0' for t in rates])}
"""

    def _text(self) -> str:
        from rotor_sim.plant import engine_text  # noqa: PLC0415 - it reads this module's layout

        shape = engine_text.Shape(
            self._assembly.size,
            self._assembly.canonical,
            len(self._ratios),
            len(self._live),
            len(self._records),
            self._switches,
            self._rows,
        )
        return engine_text.module(shape, self._equations())
