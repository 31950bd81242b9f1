# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The `rotor-rig` command line. Results also as --json; exit codes in `ExitCode`."""

import json
import math
import shlex
import sys
from collections.abc import Iterable
from contextlib import nullcontext
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TimeRemainingColumn
from typer.core import TyperGroup

from rotor_bringup.analysis_cli import add_commands
from rotor_bringup.baseline_cli import add_command as add_baseline_command
from rotor_bringup.console import folding_table, printable
from rotor_bringup.dataset.cli import add_command as add_dataset_command
from rotor_bringup.errors import ProcessError
from rotor_bringup.evaluation.cli import add_command as add_evaluate_command
from rotor_bringup.importing.cli import add_command as add_import_command
from rotor_bringup.out_path import check_file, make_folder
from rotor_bringup.paper.cli import add_command as add_paper_command
from rotor_bringup.plain_json import without_nan
from rotor_bringup.recording_cli import add_commands as add_recording_commands
from rotor_bringup.scenario import (
    DEFAULT_SCENARIO,
    Scenario,
    load_scenario,
    shipped_scenarios,
)
from rotor_interfaces import dds
from rotor_interfaces.errors import ConfigError, RigError, refusal
from rotor_interfaces.exit_code import ExitCode

console = Console(stderr=True)


class _Group(TyperGroup):
    """Turns the rig's own errors into one sentence and an exit code."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except ProcessError as error:
            _fail(str(error), ExitCode.PROCESS_FAILED)
        except RigError as error:
            _fail(str(error), ExitCode.BAD_INPUT)
        except OSError as error:
            if isinstance(error, BrokenPipeError):
                raise
            _fail(refusal(error), ExitCode.BAD_INPUT)
        except ValueError as error:
            if not (isinstance(error, UnicodeEncodeError) or 'embedded null' in str(error)):
                raise
            _fail(f'no file can have such a name ({error})', ExitCode.BAD_INPUT)


app = typer.Typer(
    cls=_Group,
    help='A virtual rig of a cracked rotor in flight maneuvers, on ROS 2 Jazzy.',
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
scenario_app = typer.Typer(cls=_Group, help='Look at scenarios and check your own.')
app.add_typer(scenario_app, name='scenario')
add_paper_command(app)
add_evaluate_command(app)

ScenarioArgument = Annotated[
    str, typer.Argument(help='Name of a shipped scenario, a YAML file, or a recording to repeat.')
]
DurationOption = Annotated[
    float | None, typer.Option('--duration', help='Length of the run in s, instead of its own.')
]
WaveformOption = Annotated[
    str | None,
    typer.Option(
        '--waveform-topic',
        help='Full name of the waveform; default: rotor/waveform of the one rig in the recording.',
    ),
]
JsonOption = Annotated[bool, typer.Option('--json', help='Print the result as JSON.')]


@app.command()
def run(
    scenario: ScenarioArgument = DEFAULT_SCENARIO,
    duration: DurationOption = None,
    rate: Annotated[
        float, typer.Option(help='Multiple of real time; 0 = as fast as nothing is lost.')
    ] = 1.0,
    record: Annotated[
        Path, typer.Option(help='Folder in which the recording gets a folder of its own.')
    ] = Path('recordings'),
    namespace: Annotated[
        str, typer.Option(help='ROS namespace of all topics, so that several rigs can fly.')
    ] = '',
    composed: Annotated[bool, typer.Option('--composed', help='All nodes in one process.')] = False,
    view: Annotated[bool, typer.Option('--view', help='Show the run live in rerun.')] = False,
    as_json: JsonOption = False,
) -> None:
    """Run a scenario live over DDS and record it; exit code 1 if anything was lost."""
    dds.require_loadable()
    from rotor_bringup.live import run_live

    plan = _load(scenario, duration)
    if not (math.isfinite(rate) and 0.0 <= rate <= 1000.0):
        raise ConfigError(f'--rate {rate:g} is out of range; allowed: 0 to 1000')
    if view:
        from vibration_monitor.view.viewer import require_screen

        require_screen()
    folder = _new_bag_folder(record, plan.name)
    try:
        result = run_live(
            plan,
            rate=rate,
            folder=folder,
            namespace=namespace,
            composed=composed,
            view=view,
            console=console,
            quiet=as_json,
        )
    except ProcessError:
        _say_where(folder)
        raise
    if as_json:
        _print_json(
            {
                'scenario': plan.name,
                'recording': str(result.recording),
                'interrupted': result.interrupted,
                'failures': result.failures,
                'warnings': result.warnings,
                **result.state.as_dict(),
            }
        )
    else:
        _say_where(folder)
        console.print(f'monitor:   {result.state.conclusion()}', soft_wrap=True, highlight=False)
        if losses := result.state.losses():
            console.print(f'lost:      {losses}', style='bold red')
        if folder.exists():
            _say_what_next(folder)
    _warn(result.warnings)
    if result.failures:
        raise ProcessError('; '.join(result.failures))
    if result.interrupted:
        raise typer.Exit(ExitCode.INTERRUPTED)
    if result.state.losses():
        raise typer.Exit(ExitCode.CHECK_FAILED)


@app.command()
def simulate(
    scenario: ScenarioArgument = DEFAULT_SCENARIO,
    out: Annotated[Path, typer.Option(help='MCAP file to write.')] = ...,  # type: ignore[assignment]
    duration: DurationOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make the recording of a scenario offline; no ROS runs."""
    from rotor_bringup.display import RunState
    from rotor_bringup.pipeline import record

    check_file(
        out,
        ['.mcap'],
        'for CSV, `rotor-rig analyze RECORDING --out FILE.csv` writes its indicators',
    )
    plan = _load(scenario, duration)
    state = RunState(plan.duration_s)
    with _progress(as_json) as progress:
        task = progress.add_task(plan.name, total=plan.duration_s)
        for step in record(plan, out):
            simulated_s = (step.block.first_sample + len(step.block.rows)) / plan.rate_hz
            state.advance(simulated_s)
            for window in step.records:
                state.take_record(window, (window.stamp_ns - plan.epoch_ns) * 1e-9)
            progress.update(task, completed=simulated_s)
    if as_json:
        _print_json({'scenario': plan.name, 'recording': str(out), **state.as_dict()})
    else:
        console.print(f'recording: {out}', soft_wrap=True, highlight=False)
        console.print(f'monitor:   {state.conclusion()}', soft_wrap=True, highlight=False)


@app.command()
def replay(
    file: Annotated[Path, typer.Argument(help='Recording: bag folder or MCAP file.')],
    rate: Annotated[float, typer.Option(help='Multiple of real time, above 0.')] = 1.0,
    loop: Annotated[bool, typer.Option('--loop', help='Start again at the end.')] = False,
    start: Annotated[float, typer.Option(help='Skip this many s.')] = 0.0,
    topic: Annotated[
        list[str] | None, typer.Option(help='Only this topic; may be given several times.')
    ] = None,
) -> None:
    """Publish a recording again, with its own times as /clock."""
    from vibration_monitor.replay_node import replay as replay_recording

    code = replay_recording(file, rate=rate, loop=loop, start_s=start, topics=topic)
    raise typer.Exit(code)


@app.command()
def analyze(
    file: Annotated[Path, typer.Argument(help='Recording: bag folder or MCAP file.')],
    out: Annotated[
        Path | None, typer.Option(help='Write every window: .json or .csv by the ending.')
    ] = None,
    waveform_topic: WaveformOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run the monitor over a recording: the same indicators as live."""
    from rotor_bringup.analysis import analyze_recording, windows_file

    with nullcontext() if out is None else windows_file(out) as on_window:
        analysis = analyze_recording(file, waveform_topic, on_window)
    _warn(analysis.damage)
    if as_json:
        _print_json(analysis.summary())
        return
    if analysis.samples is None:
        title = f'{analysis.state.windows} windows'
        table = folding_table('indicator', 'median', 'largest', title=title)
        for name, median, largest in analysis.highlights:
            table.add_row(name, f'{median:.4g}', f'{largest:.4g}')
        Console().print(table)
    else:
        Console().print(analysis.samples.table())
        Console().print(f'no window: {analysis.samples.reason}', soft_wrap=True, highlight=False)
    Console().print(f'monitor: {analysis.state.conclusion()}', soft_wrap=True, highlight=False)
    if analysis.lost_samples:
        Console().print(f'lost: {analysis.lost_samples} samples, by the sample index')


@app.command()
def view(
    file: Annotated[Path, typer.Argument(help='Recording: bag folder or MCAP file.')],
    save: Annotated[Path | None, typer.Option(help='Write a .rrd file instead.')] = None,
    screenshot: Annotated[
        Path | None, typer.Option(help='Write a .png of the view instead, without a screen.')
    ] = None,
    waveform_topic: WaveformOption = None,
) -> None:
    """Show a recording in rerun: plots, orbit, spectra and the rig in 3-D."""
    from vibration_monitor.view import view_recording

    _warn(view_recording(file, save=save, screenshot=screenshot, waveform_topic=waveform_topic))


@scenario_app.command('list')
def list_scenarios(as_json: JsonOption = False) -> None:
    """List the scenarios that come with the rig."""
    scenarios = [load_scenario(name) for name in shipped_scenarios()]
    if as_json:
        _print_json({plan.name: plan.description for plan in scenarios})
        return
    table = folding_table('name', 'length', 'what it shows', box=None)
    for plan in scenarios:
        table.add_row(plan.name, f'{plan.duration_s:g} s', plan.description)
    Console().print(table)


@scenario_app.command('show')
def show_scenario(scenario: ScenarioArgument, as_json: JsonOption = False) -> None:
    """Show a scenario with every value it leaves to the defaults."""
    plan = load_scenario(scenario)
    if as_json:
        _print_json(plan.plain())
    else:
        typer.echo(plan.yaml(), nl=False)


@scenario_app.command('check')
def check_scenario(
    file: Annotated[str, typer.Argument(help='YAML file of a scenario.')],
    as_json: JsonOption = False,
) -> None:
    """Check a scenario without running it."""
    plan = load_scenario(file)
    if as_json:
        _print_json({'scenario': plan.name, 'ok': True, 'warnings': plan.warnings()})
    else:
        _warn(plan.warnings())
        typer.echo(f'{plan.name}: good, {plan.duration_s:g} s')


def _load(source: str, duration: float | None) -> Scenario:
    plan = load_scenario(source, **({} if duration is None else {'duration_s': duration}))
    _warn(plan.warnings())
    return plan


def _new_bag_folder(parent: Path, name: str) -> Path:
    """Return a folder name that does not exist yet; the recorder makes the folder.

    Raises ConfigError where nothing can be written into `parent`.
    """
    make_folder(parent, '--record')
    stem = f'{name}-{datetime.now(UTC):%Y%m%d-%H%M%S}'
    candidates = [parent / stem, *(parent / f'{stem}-{number}' for number in range(2, 100))]
    return next(folder for folder in candidates if not folder.exists()).absolute()


def _warn(sentences: Iterable[str]) -> None:
    for sentence in sentences:
        console.print(
            f'warning: {printable(sentence)}',
            style='yellow',
            soft_wrap=True,
            highlight=False,
            markup=False,
        )


def _say_where(folder: Path) -> None:
    """Name the recording, where the run came so far as to make one."""
    if folder.exists():
        console.print(f'recording: {_as_typed(folder)}', soft_wrap=True, highlight=False)


def _say_what_next(folder: Path) -> None:
    """Print the two commands to view and replay a recording, as they can be typed here."""
    program, recording = _as_typed(Path(sys.argv[0])), _as_typed(folder)
    for what, verb in (('view it:  ', 'view'), ('replay it:', 'replay')):
        console.print(f'{what} {program} {verb} {recording}', soft_wrap=True, highlight=False)


def _as_typed(path: Path) -> str:
    """Return a path as a person here would type it."""
    short = path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
    return shlex.quote(str(short))


def _progress(quiet: bool) -> Progress:
    return Progress(
        SpinnerColumn(),
        *Progress.get_default_columns()[:-1],
        TimeRemainingColumn(),
        console=console,
        disable=quiet or not console.is_terminal,
        transient=True,
    )


def _print_json(data: dict[str, Any]) -> None:
    typer.echo(json.dumps(without_nan(data), indent=2))


def _fail(sentence: str, code: ExitCode) -> None:
    text = f'error: {printable(sentence)}'
    console.print(text, style='red', soft_wrap=True, highlight=False, markup=False)
    raise typer.Exit(code)


add_baseline_command(app, _print_json)
add_commands(app, console, _print_json)
add_import_command(app, console, _print_json)
add_dataset_command(app, console, _print_json)
add_recording_commands(app, console, _print_json)
