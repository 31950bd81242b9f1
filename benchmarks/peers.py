# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Time other solvers on the same orbit diagram and the same exponent, at matched error.

    python benchmarks/peers.py [--rounds N] [--json FILE] [--markdown FILE]

It runs in an environment of its own, see docs/performance.md; a peer that is missing is said so.

The task: `derived`, 352 rad/s, G = 3; an orbit diagram over 16 values of K, 60 + 20 revolutions,
and the largest Lyapunov exponent at K = 0.1, 30 + 270 revolutions. The error of a solver: the
largest difference of the disk's Y, Z at the first 20 strobes, K = 0.1, from DOP853 at 1e-12. Each
solver runs at the loosest tolerance whose error is at most that of this project at 256 and at 512
steps a revolution. CPU time on one core; the solvers take turns, and times and ratios are medians
over the rounds, since the machine's speed moves. Compiling is timed apart.
"""

import argparse
import importlib.metadata
import inspect
import json
import math
import os
import time
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import c_peer
import equations as model
import numeric_solvers as numeric
import numpy as np
import report
import symbolic_solvers as symbolic
from equations import START, TURN, Array
from hou_equations import Drive, derivative
from rich.console import Console

from rotor_common.constants import GRAVITY_M_S2

CRACKS = np.linspace(0.0, 0.3, 16)
CRACK = np.array([0.1])
ORBIT = (60, 20)
EXPONENT = (30, 270)
MATCH = (1, 20)
STEPS = (256, 512)
TOLERANCES = 10.0 ** -np.arange(2.0, 12.1, 0.25)
AGREEMENT = 1e-12


@dataclass(frozen=True)
class Peer:
    """A solver: its package, its functions in a module, and what a user has to write besides."""

    name: str
    package: str
    module: ModuleType
    functions: str
    helpers: tuple[Callable[..., Any], ...] = ()
    fixed_steps: bool = False
    sources: tuple[str, ...] = ()
    options: tuple[tuple[str, float], ...] = ()

    def offers(self, task: str) -> bool:
        """Return whether there is a function for the task 'orbit' or 'exponent'."""
        return hasattr(self.module, f'{self.functions}_{task}')

    def prepare(self, task: str, *arguments: Any) -> Any:
        """Return what runs a task, or None where it is not offered; everything is compiled."""
        if not self.offers(task):
            return None
        function = getattr(self.module, f'{self.functions}_{task}')
        prepared: Callable[[], Any] = function(*arguments, **dict(self.options))
        return prepared

    def lines(self, task: str) -> int:
        """Count the lines of code that the task takes a user, without blanks and comments."""
        if not self.offers(task):
            return 0
        helpers = [h for h in self.helpers if task == 'exponent' or h is not model.growth]
        functions = [getattr(self.module, f'{self.functions}_{task}'), *helpers]
        texts = [inspect.getsource(inspect.unwrap(function)) for function in functions]
        texts += [(Path(__file__).parent / source).read_text('utf-8') for source in self.sources]
        return sum(map(code_lines, texts))


ODE = (model.equations,)
SYMBOLS = (model.equations, model.as_it_is)
NUMBA = (*ODE, numeric.numba_equations, model.growth)
PEERS = (
    Peer('rotor_sim', 'rotor_sim', numeric, 'rig', fixed_steps=True),
    Peer('rotor_sim, orbit_diagram', 'rotor_sim', numeric, 'diagram', fixed_steps=True),
    Peer('C, gcc -O3, RK4', '', numeric, 'c', (c_peer.c_library, c_peer.Rotor, numeric.c_rotor,
         numeric.c_advance, model.growth), fixed_steps=True, sources=('peer.c',)),
    Peer('scipy DOP853', 'scipy', numeric, 'scipy_dop853', (*NUMBA, numeric.numba_single)),
    Peer('scipy LSODA', 'scipy', numeric, 'scipy_lsoda', (*NUMBA, numeric.numba_single)),
    Peer(f'CyRK {numeric.CYRK_METHOD}', 'CyRK', numeric, 'cyrk', (*NUMBA, numeric.cyrk_address)),
    Peer('jitcode dopri5', 'jitcode', symbolic, 'jitcode', (*SYMBOLS, symbolic.jitcode_compiled)),
    Peer('diffrax Dopri8', 'diffrax', symbolic, 'diffrax', (*SYMBOLS, symbolic.jax_equations)),
    Peer('heyoka', 'heyoka', symbolic, 'heyoka', (*SYMBOLS, symbolic.heyoka_system)),
    Peer('heyoka, steps held short', 'heyoka', symbolic, 'heyoka',
         (*SYMBOLS, symbolic.heyoka_system),
         options=(('longest', 0.02),)),
)  # fmt: skip


@dataclass
class Row:
    """One solver matched to one number of steps; NaN where it failed, `note` says why."""

    solver: str
    version: str
    steps: int
    tolerance: float = math.nan
    error: float = math.nan
    prepare_s: float = math.nan
    orbit_s: float = math.nan
    orbit_ratio: float = math.nan
    exponent: float = math.nan
    exponent_s: float = math.nan
    exponent_ratio: float = math.nan
    orbit_lines: int = 0
    exponent_lines: int = 0
    note: str = ''
    orbit_times_s: list[float] = field(default_factory=list)
    exponent_times_s: list[float] = field(default_factory=list)


def code_lines(text: str) -> int:
    """Count lines that are neither blank nor comment nor documentation."""
    count, inside = 0, False
    for line in (line.strip() for line in text.splitlines()):
        if inside:
            inside = not line.endswith(('*/', '"""'))
        elif line.startswith(('/*', '"""')):
            inside = not (line.endswith(('*/', '"""')) and len(line) > 3)
        elif line and not line.startswith(('#:', '# ', '//')):
            count += 1
    return count


def check_equations() -> float:
    """Return the largest relative difference of the peers' equations from `hou_equations`.

    In the norm of the accelerations, over random states. Raises AssertionError above 1e-12.
    """
    f = model.equations(np.sin, np.cos, np.sqrt, np.abs, lambda x: np.clip(x, -0.5, 0.5),
                        model.as_it_is)  # fmt: skip
    rng = np.random.default_rng(1)
    worst, speed = 0.0, model.SPEED_RAD_S
    for _ in range(1000):
        x, tau, K = rng.normal(0.0, 3.0, 12), rng.uniform(0.0, 600.0), rng.uniform(0.0, 0.3)
        load = model.LOAD_FACTOR * GRAVITY_M_S2
        drive = Drive(tau, speed, load, crack_stiffness_ratio=K)
        wanted = derivative(model.ROTOR, x * model.UNITS, drive) / (model.UNITS * speed)
        difference = np.abs(np.array(f(tau, x, K)) - wanted).max()
        worst = max(worst, float(difference / np.abs(wanted).max()))
    if not worst <= AGREEMENT:
        raise AssertionError(f'the equations of the peers differ from the model by {worst:.1e}')
    return worst


def reference() -> Array:
    """Return Y, Z (20, 2) at the strobes that solvers are matched at."""
    from scipy.integrate import solve_ivp  # noqa: PLC0415 - needed once

    tau = TURN * np.arange(MATCH[0], sum(MATCH))
    options = {'t_eval': tau, 'args': CRACK, 'rtol': 1e-12, 'atol': 1e-12}
    done = solve_ivp(numeric.numba_single(), (0.0, tau[-1]), START, 'DOP853', **options)
    return np.asarray(done.y[:2].T)


def error_of(peer: Peer, tolerance: float, wanted: Array) -> float:
    """Return the largest difference from the reference; NaN if the solver gave up."""
    states = peer.prepare('orbit', CRACK, *MATCH, tolerance)()
    return float(np.abs(states[0, :, :2] - wanted).max())


def match(peer: Peer, allowed: dict[int, float], wanted: Array) -> list[Row]:
    """Return a row for each number of steps, with the loosest tolerance that does."""
    if peer.fixed_steps:
        tried = {1.0 / steps: error_of(peer, 1.0 / steps, wanted) for steps in allowed}
        chosen: dict[int, float | None] = {steps: 1.0 / steps for steps in allowed}
    else:
        tried = {}
        for tolerance in TOLERANCES:
            tried[tolerance] = error_of(peer, tolerance, wanted)
            if tried[tolerance] <= min(allowed.values()):
                break
        chosen = {
            steps: next((t for t, error in tried.items() if error <= limit), None)
            for steps, limit in allowed.items()
        }
    rows = []
    for steps, tolerance in chosen.items():
        row = Row(peer.name, version(peer), steps)
        row.orbit_lines, row.exponent_lines = peer.lines('orbit'), peer.lines('exponent')
        if tolerance is None:
            best = min((error for error in tried.values() if error >= 0.0), default=math.nan)
            row.note = f'does not reach the error at any tolerance; best {best:.1e}'
        else:
            row.tolerance, row.error = tolerance, tried[tolerance]
        rows.append(row)
    return rows


def version(peer: Peer) -> str:
    """Return the version of the peer's package."""
    if not peer.package:
        return c_peer.c_compiler()
    return importlib.metadata.version(peer.package)


def prepare(rows: list[Row]) -> list[tuple[Row, str, Callable[[], Any]]]:
    """Return what is to be timed: row, task, function. Rows that fail say so in their note."""
    runs = []
    for row in rows:
        if math.isnan(row.tolerance):
            continue
        peer = next(peer for peer in PEERS if peer.name == row.solver)
        started = time.perf_counter()
        for task, values, counts in (('orbit', CRACKS, ORBIT), ('exponent', CRACK, EXPONENT)):
            try:
                run = peer.prepare(task, values, *counts, row.tolerance)
            except Exception as error:  # noqa: BLE001 - whatever a library throws is its result
                row.note = reason(error)
            else:
                runs += [(row, task, run)] if run else []
        row.prepare_s = time.perf_counter() - started
    return runs


def attempt(row: Row, run: Callable[[], Any]) -> tuple[float, Any]:
    """Return CPU seconds and result; both NaN where the run fails, and the row notes why."""
    try:
        seconds, result = report.timed(run)
        finite = bool(np.isfinite(result).all())
    except Exception as error:  # noqa: BLE001 - whatever a library throws is its result
        row.note = reason(error)
        return math.nan, math.nan
    if not finite:
        row.note = 'the result is not finite'
        return math.nan, math.nan
    return seconds, result


def measure(rows: list[Row], rounds: int, console: Console) -> None:
    """Run both tasks of every row, in turns; fill in times and ratios."""
    runs = prepare(rows)
    for number in range(rounds):
        console.print(f'round {number + 1} of {rounds}', style='dim')
        for row, task, run in runs:
            seconds, result = attempt(row, run)
            getattr(row, f'{task}_times_s').append(seconds)
            if task == 'exponent':
                row.exponent = result
    for row, task, _ in runs:
        ours = next(other for other in rows if other.steps == row.steps)
        times, base = getattr(row, f'{task}_times_s'), getattr(ours, f'{task}_times_s')
        # numpy's median of times with a NaN is NaN: a solver that failed once has no time
        setattr(row, f'{task}_s', float(np.median(times)))
        setattr(row, f'{task}_ratio', float(np.median(np.divide(times, base))))


def reason(error: BaseException) -> str:
    """Return one line on why a solver has no result."""
    if isinstance(error, ImportError | importlib.metadata.PackageNotFoundError):
        return f'not installed ({error.name})'
    return f'{type(error).__name__}: {error}'.splitlines()[0][:120]


COLUMNS = (
    *('solver', 'version', 'matched to N', 'tolerance', 'error', 'orbit diagram [s]'),
    *('ratio', 'exponent [s]', 'ratio', 'exponent', 'lines', 'prepare [s]', 'note'),
)


def cells(row: Row) -> tuple[str, ...]:
    """Return the texts of a row of the table, in the order of COLUMNS."""

    def text(value: float, form: str) -> str:
        return '' if math.isnan(value) else format(value, form)

    peer = next(peer for peer in PEERS if peer.name == row.solver)
    return (
        *(row.solver, row.version, str(row.steps)),
        *('fixed' if peer.fixed_steps else text(row.tolerance, '.1e'), text(row.error, '.1e')),
        *(text(row.orbit_s, '.3g'), text(row.orbit_ratio, '.1f')),
        *(text(row.exponent_s, '.3g'), text(row.exponent_ratio, '.1f')),
        text(row.exponent, '.4f') if peer.offers('exponent') else 'not offered',
        ', '.join(str(lines) for lines in (row.orbit_lines, row.exponent_lines) if lines),
        *(text(row.prepare_s, '.1f'), row.note),
    )


def main() -> None:
    """Match, time, print one table."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').splitlines()[0])
    parser.add_argument('--rounds', type=int, default=5, help='timings of each, default 5')
    parser.add_argument('--json', type=Path, help='write the numbers to this file')
    parser.add_argument('--markdown', type=Path, help='replace the table in this page')
    options = parser.parse_args()
    report.use_one_core()
    os.environ['JAX_PLATFORMS'] = 'cpu'
    warnings.simplefilter('ignore')  # solvers complain about loose tolerances that we try
    console = report.wide_console()
    console.print(f'equations agree with hou_equations to {check_equations():.0e}')
    wanted = reference()
    allowed = {steps: error_of(PEERS[0], 1.0 / steps, wanted) for steps in STEPS}
    rows: list[Row] = []
    for peer in PEERS:
        console.print(f'matching {peer.name}', style='dim')
        try:
            rows += match(peer, allowed, wanted)
        except Exception as error:  # noqa: BLE001 - whatever a library throws is its result
            rows += [Row(peer.name, '', steps, note=reason(error)) for steps in STEPS]
    rows.sort(key=lambda row: row.steps)
    measure(rows, options.rounds, console)
    table = [COLUMNS, *(cells(row) for row in rows)]
    report.show(console, table)
    if options.json:
        data = {'machine': report.machine(), 'rows': [asdict(row) for row in rows]}
        options.json.write_text(json.dumps(data, indent=1) + '\n', 'utf-8')
    if options.markdown:
        report.write_markdown(options.markdown, 'peers.py', table)


if __name__ == '__main__':
    main()
