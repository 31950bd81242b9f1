# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The commands orbit-diagram, waterfall, lyapunov, poincare and map.

Each command is a dataclass: its fields are the options, `compute` does the work. Everything that
can be wrong with the options is found before anything is computed.
"""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
import typer
from numpy.typing import NDArray

from rotor_common.console import print_json, say
from rotor_common.exit_code import ExitCode
from rotor_common.options import JsonOption
from rotor_common.progress import OnProgress, interruptible
from rotor_dynamics.errors import AnalysisError
from rotor_dynamics.swept_values import change_of, unless_swept, values_of
from rotor_sim.plant.parameters import RotorParameters

if TYPE_CHECKING:
    from rotor_dynamics import OperatingPoint, Plan
    from rotor_dynamics.sweep_files import SweepResult
    from rotor_dynamics.sweep_runs import Resources

PAPER_SPEED_RAD_S = 352.0
PAPER_LOAD_FACTOR = 3.0
MOST_NUMBERS = 10_000_000
"""Values times revolutions of a sweep: all of it in memory is then below 2 GiB."""
EXPONENT_REVOLUTIONS = 500
MAP_EXPONENT_REVOLUTIONS = 200
MOST_SECTIONS = 25
"""More sections than this cannot be told apart in one picture."""

_OVER = typer.Option(
    metavar='PARAMETER START STOP COUNT',
    help='COUNT values from START to STOP, in SI, of speed, G, K, clearance, eccentricity or a '
    'number of RotorParameters by its name.',
)
Over = Annotated[tuple[str, str, str, str], _OVER]
MaybeOver = Annotated[tuple[str, str, str, str] | None, _OVER]


@dataclass(frozen=True)
class Question:
    """The checked question: one point, or a point for each of `values` of the field `over`."""

    parameters: RotorParameters
    over: str | None
    values: NDArray[np.float64]
    speed_rad_s: float | None
    load_factor: float | None
    points: 'tuple[OperatingPoint, ...]'
    plan: 'Plan'

    def asked(self, command: str) -> dict[str, Any]:
        """Return the question in JSON types."""
        from rotor_dynamics.plots import RECONSTRUCTION

        variant = self.parameters.variant
        return {
            'command': command,
            'note': RECONSTRUCTION if variant.startswith('figure') else '',
            'parameters': self.parameters.model_dump(),
            'over': self.over,
            'speed_rad_s': self.speed_rad_s,
            'load_factor': self.load_factor,
            **dataclasses.asdict(self.plan),
        }


@dataclass(frozen=True, kw_only=True)
class AnalysisCommand(ABC):
    """Options that the four commands share."""

    name: ClassVar[str]

    over: MaybeOver = None
    variant: Annotated[str, typer.Option(help='Reading of the paper (docs/physics.md).')] = (
        'derived'
    )
    speed: Annotated[
        float | None, typer.Option(help=f'Speed in rad/s; default {PAPER_SPEED_RAD_S:g}.')
    ] = None
    load: Annotated[
        float | None, typer.Option(help=f'Load factor G; default {PAPER_LOAD_FACTOR:g}.')
    ] = None
    settings: Annotated[
        list[str] | None,
        typer.Option('--set', metavar='NAME=VALUE', help='Change a parameter of the rotor (SI).'),
    ] = None
    transient: Annotated[int, typer.Option(help='Revolutions to leave out.')] = 1000
    revolutions: Annotated[int, typer.Option(help='Revolutions to record.')] = 300
    steps: Annotated[
        int, typer.Option(help='Steps a revolution, at least: slow speeds take more.')
    ] = 256
    no_check: Annotated[
        bool, typer.Option('--no-check', help='Skip the comparison with twice the steps.')
    ] = False
    out: Annotated[
        list[Path] | None,
        typer.Option(
            help='File to write: .png, .svg, .npz or .parquet; may be given several times. '
            'Default: a .png named after the command.'
        ),
    ] = None
    as_json: JsonOption = False
    scheduler: Annotated[
        str | None, typer.Option(help='dask scheduler to compute on, tcp://host:port.')
    ] = None
    jobs: Annotated[
        int | None, typer.Option(help='Threads on this machine; default: all cores.')
    ] = None
    cache: Annotated[
        Path | None, typer.Option(help='Folder that keeps results: a repeated run continues.')
    ] = None

    def run(self) -> None:
        """Check the options, compute, write the files and print the result."""
        from rotor_dynamics.sweep_files import check_paths, save

        check_paths(self.paths)
        self.check()
        question = self.question()

        from rotor_dynamics.cluster import check_executor

        check_executor(self.scheduler, self.jobs)
        with interruptible(self.name, self.cache, quiet=self.as_json) as on_progress:
            outcome = self.compute(question, on_progress)
        for path in self.paths:
            save(outcome, path)
        if self.as_json:
            print_json(
                {**outcome.asked, **outcome.found, 'files': [str(path) for path in self.paths]}
            )
        else:
            for line in (*outcome.sentences, *(f'wrote {path}' for path in self.paths)):
                say(line)
        if outcome.failed:
            raise typer.Exit(ExitCode.CHECK_FAILED)

    @property
    def paths(self) -> list[Path]:
        """The files to write."""
        return self.out or [Path(f'{self.name}.png')]

    def check(self) -> None:  # noqa: B027 - most have nothing to refuse
        """Raise AnalysisError for options that do not go together."""

    @abstractmethod
    def compute(self, question: Question, on_progress: OnProgress) -> 'SweepResult':
        """Return the outcome of the analysis."""

    def plan(self) -> 'Plan':
        """Return what is computed at every point; AnalysisError for numbers out of range."""
        return self._plan(revolutions=self.revolutions)

    def question(self) -> Question:
        """Return the checked question; RigError with one sentence for any wrong option."""
        from rotor_dynamics.ensemble import OperatingPoint, steps_needed
        from rotor_dynamics.surveys import ALIASES, sweep

        over, values = None, np.empty(0)
        if self.over is not None:
            over, values = ALIASES.get(self.over[0], self.over[0]), values_of(*self.over[1:])
        changes = dict(change_of(text, ALIASES) for text in self.settings or [])
        if over in changes:
            raise AnalysisError(f'--set {over} has no meaning, since --over sweeps it')
        speed = unless_swept('--speed', self.speed, PAPER_SPEED_RAD_S, swept=over == 'speed_rad_s')
        load = unless_swept('--load', self.load, PAPER_LOAD_FACTOR, swept=over == 'load_factor')
        parameters = RotorParameters.hou2016(self.variant, **changes)
        plan = self.plan()
        if len(values) * plan.revolutions > MOST_NUMBERS:
            raise AnalysisError(
                f'{len(values)} values of {plan.revolutions} revolutions are too many at once; '
                f'their product may be {MOST_NUMBERS:,}'
            )
        if over is not None:
            points = sweep(parameters, over, values, speed_rad_s=speed, load_factor=load)
        else:
            points = (OperatingPoint(parameters, speed or 0.0, load or 0.0),)
        for point in points:
            steps_needed(point, plan.steps_per_revolution)
        return Question(parameters, over, values, speed, load, points, plan)

    def resources(self) -> 'Resources':
        """Return where a sweep is computed and kept."""
        from rotor_dynamics.sweep_runs import Resources

        return Resources(self.scheduler, self.jobs, self.cache)

    def _plan(self, **numbers: Any) -> 'Plan':
        from rotor_dynamics import Plan

        return Plan(
            transient_revolutions=self.transient,
            steps_per_revolution=self.steps,
            check_steps=not self.no_check,
            **numbers,
        )

    def _refuse(self, options: Mapping[str, object], why: str) -> None:
        """Raise AnalysisError if one of `options` was given a value."""
        for option, value in options.items():
            if value:
                raise AnalysisError(f'{option} has no meaning {why}; leave it out')


@dataclass(frozen=True, kw_only=True)
class _Directed(AnalysisCommand):
    """A sweep that may continue from value to value."""

    over: Over = field()  # required here
    direction: Annotated[
        Literal['fixed', 'up', 'down'],
        typer.Option(help='Start all values alike, or each where the one below or above ended.'),
    ] = 'fixed'

    def check(self) -> None:
        """Refuse options without use in a continuation: it is one long trajectory."""
        if self.direction != 'fixed':
            options = {'--scheduler': self.scheduler, '--jobs': self.jobs, '--cache': self.cache}
            self._refuse(options, f'with --direction {self.direction}')

    def compute(self, question: Question, on_progress: OnProgress) -> 'SweepResult':
        """Return the diagram."""
        from rotor_dynamics.sweep_runs import run_continuation, run_sweep

        if self.direction != 'fixed':
            return run_continuation(self.name, question, self.direction)
        return run_sweep(self.name, question, self.resources(), on_progress)


@dataclass(frozen=True, kw_only=True)
class OrbitDiagramCommand(_Directed):
    """Draw the orbit (bifurcation) diagram: Y and Z once a revolution over a parameter.

    Example: rotor-rig orbit-diagram --over K 0 0.3 200 --out diagram.png
    """

    name: ClassVar[str] = 'orbit-diagram'


@dataclass(frozen=True, kw_only=True)
class WaterfallCommand(_Directed):
    """Draw the amplitude spectra of Y and Z over a parameter.

    Example: rotor-rig waterfall --over speed 200 800 60
    """

    name: ClassVar[str] = 'waterfall'

    def plan(self) -> 'Plan':
        """Return a plan with spectra."""
        from rotor_dynamics.diagrams import BAND

        return self._plan(revolutions=self.revolutions, highest_order=BAND)


class _PointOrSweep(AnalysisCommand):
    """A command for one point or, with --over, for many."""

    def check(self) -> None:
        if self.over is None:
            options = {'--scheduler': self.scheduler, '--jobs': self.jobs, '--cache': self.cache}
            self._refuse(options, 'at one point, which takes seconds')


@dataclass(frozen=True, kw_only=True)
class LyapunovCommand(_PointOrSweep):
    """Compute the largest Lyapunov exponent per unit tau, at one point or over a parameter.

    Example: rotor-rig lyapunov --speed 542 --load 3
    """

    name: ClassVar[str] = 'lyapunov'
    revolutions: Annotated[int, typer.Option(help='Revolutions of the exponent.')] = (
        EXPONENT_REVOLUTIONS
    )
    method: Annotated[
        Literal['tangent', 'two-trajectories'], typer.Option(help='How, at one point.')
    ] = 'tangent'
    spectrum: Annotated[
        bool, typer.Option('--spectrum', help='All twelve exponents, at one point.')
    ] = False

    def plan(self) -> 'Plan':
        """Return a plan with exponents."""
        if self.revolutions == 0:
            raise AnalysisError('--revolutions 0 is out of range; allowed: 50 or more')
        return self._plan(exponent_revolutions=self.revolutions)

    def check(self) -> None:
        """Refuse options without use in a sweep: it only finds the largest exponent by tangents."""
        super().check()
        if self.over is not None:
            options = {'--spectrum': self.spectrum, '--method': self.method != 'tangent'}
            self._refuse(options, 'with --over')

    def compute(self, question: Question, on_progress: OnProgress) -> 'SweepResult':
        """Return one exponent or the diagram."""
        from rotor_dynamics.sweep_runs import run_exponent, run_sweep

        if self.over is None:
            return run_exponent(question, self.method, spectrum=self.spectrum)
        return run_sweep(self.name, question, self.resources(), on_progress)


@dataclass(frozen=True, kw_only=True)
class PoincareCommand(_PointOrSweep):
    """Draw one motion (orbit, phase portrait, section, spectrum), or sections over a parameter.

    Example: rotor-rig poincare --speed 352 --set K=0.1 --out motion.png
    """

    name: ClassVar[str] = 'poincare'

    def plan(self) -> 'Plan':
        """Return a plan with exponents, since the label of a motion rests on them."""
        return self._plan(revolutions=self.revolutions, exponent_revolutions=EXPONENT_REVOLUTIONS)

    def check(self) -> None:
        """Refuse more sections than fit into a picture."""
        from rotor_dynamics.sweep_files import is_picture

        super().check()
        if self.over is not None and any(is_picture(path) for path in self.paths):
            count = len(values_of(*self.over[1:]))
            if count > MOST_SECTIONS:
                raise AnalysisError(
                    f'COUNT = {count} sections do not fit into a picture; take at most '
                    f'{MOST_SECTIONS}, or --out FILE.npz'
                )

    def compute(self, question: Question, on_progress: OnProgress) -> 'SweepResult':
        """Return one motion or the sections."""
        from rotor_dynamics.sweep_runs import run_section, run_sweep

        if self.over is None:
            return run_section(question)
        return run_sweep(self.name, question, self.resources(), on_progress)


@dataclass(frozen=True, kw_only=True)
class MapCommand(AnalysisCommand):
    """Draw the largest exponent and the super-harmonics of Z over two parameters.

    Example: rotor-rig map --over speed 300 600 20 --against K 0 0.2 10
    """

    name: ClassVar[str] = 'map'
    over: Over
    against: Annotated[
        tuple[str, str, str, str],
        typer.Option(
            metavar='PARAMETER START STOP COUNT', help='The second parameter, as with --over.'
        ),
    ]
    transient: Annotated[int, typer.Option(help='Revolutions to leave out.')] = 300
    revolutions: Annotated[int, typer.Option(help='Revolutions to record.')] = 100

    def plan(self) -> 'Plan':
        """Return a plan with exponents over fewer revolutions than elsewhere."""
        return self._plan(
            revolutions=self.revolutions, exponent_revolutions=MAP_EXPONENT_REVOLUTIONS
        )

    def question(self) -> Question:
        """Return the question along --over; refuse what --against sweeps."""
        from rotor_dynamics.surveys import ALIASES

        second = ALIASES.get(self.against[0], self.against[0])
        given = {'speed_rad_s': ('--speed', self.speed), 'load_factor': ('--load', self.load)}
        option, value = given.get(second, ('', None))
        if value is not None:
            raise AnalysisError(f'{option} has no meaning, since --against sweeps it')
        if second in (ALIASES.get(text.split('=')[0], text) for text in self.settings or []):
            raise AnalysisError(f'--set {second} has no meaning, since --against sweeps it')
        return super().question()

    def compute(self, question: Question, on_progress: OnProgress) -> 'SweepResult':
        """Return the map."""
        from rotor_dynamics.sweep_runs import run_map

        values = values_of(*self.against[1:], option='--against')
        return run_map(question, self.against[0], values, self.resources(), on_progress)
