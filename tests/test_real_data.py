# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of real machines: what is known to be in them is found.

The recordings are not ours to copy: where the folder is absent their tests skip. Synthetic files
of the same formats stand in, so that the importer and the monitor are always tested on them.
"""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from rig_support import Rig
from rotor_recording.importing.convert import ImportPlan, convert
from rotor_recording.reading import Recording, waveform_blocks
from vibration_monitor.envelope import EnvelopeSpectrum, envelope_spectrum

ROOT = Path(__file__).resolve().parents[1]
REALDATA = Path(os.environ.get('ROTOR_RIG_REALDATA', ROOT.parent / 'shared' / 'realdata'))
FIGURES = ROOT / 'docs' / 'make_real_data_figures.py'
real = pytest.mark.skipif(
    not (REALDATA / 'mfpt').is_dir(),
    reason='no real data: set ROTOR_RIG_REALDATA to the folder that holds mfpt/',
)

BAND_HZ = (2000.0, 8000.0)
MFPT_RATE_HZ = 48_828
BPFI, BPFO = 118.875 / 25, 81.125 / 25
"""Orders of the bearing, from its geometry, as the files of MFPT state them."""


def spectrum_of(recording: Path) -> EnvelopeSpectrum:
    rows = np.concatenate([block.rows for block in waveform_blocks(Recording(recording))])
    return envelope_spectrum(rows['brg1_ay'].astype(np.float64), MFPT_RATE_HZ, BAND_HZ)


def write_mfpt(path: Path, strikes_hz: float, shaft_hz: float) -> None:
    """Write a file as MFPT's: a fault in the inner race strikes a resonance at 4 kHz."""
    time = np.arange(3 * MFPT_RATE_HZ) / MFPT_RATE_HZ
    since = (time * strikes_hz % 1.0) / strikes_hz
    load = 1 + 0.8 * np.cos(2 * np.pi * shaft_hz * time)
    ringing = load * np.exp(-since / 5e-4) * np.sin(2 * np.pi * 4000.0 * since)
    noise = 0.02 * np.random.default_rng(3).standard_normal(len(time))
    gs = (ringing + noise + 0.2 * np.cos(2 * np.pi * shaft_hz * time))[:, np.newaxis]
    bearing = {'rate': 25, 'load': '0', 'gs': gs, 'sr': MFPT_RATE_HZ}
    savemat(path, {'bearing': bearing, 'BPFI': 118.875, 'BPFO': 81.125})


def write_run_up(path: Path) -> None:
    """Write a file as that of OTA_MLE: vibration and a sine a revolution, without a header."""
    time = np.arange(40 * 1280) / 1280
    angle = 2 * np.pi * (5.0 * time + 1.35 * time**2 / 2)
    orders = 3.0 * np.cos(angle) + 0.5 * np.cos(4 * angle + 1.0)
    np.savetxt(path, np.column_stack([orders, 2.0 * np.sin(angle)]), delimiter='\t')


@pytest.mark.slow
def test_a_bearing_of_mfpts_layout_goes_all_the_way(rig: Rig, tmp_path: Path) -> None:
    path, out = tmp_path / 'bearing.mat', tmp_path / 'bearing.mcap'
    write_mfpt(path, 117.8, 24.7)
    done = rig('import', path, '--out', out, '--speed-hz', 24.7, '--json', '--source', 'synthetic')
    assert done.code == 0, done.err
    assert done.json['rate_hz'] == MFPT_RATE_HZ
    assert done.json['source'] == 'synthetic'
    assert done.json['file_says']['BPFI'] == 118.875
    spectrum = spectrum_of(out)
    line = spectrum.line_near(BPFI * 24.7)
    # noise alone stays below 4
    assert line.prominence > 20
    assert abs(line.frequency_hz - 117.8) < spectrum.frequency_hz[1]
    for side in (-24.7, 24.7):
        beside = spectrum.line_near(117.8 + side, 0.003)
        # 1 + 0.8 cos: sidebands of 0.4; the noise between the strikes, which the envelope
        # cannot fall below, and the edges of the band take and give a few percent
        assert beside.amplitude == pytest.approx(0.4 * line.amplitude, rel=0.1)
    analyzed = rig('analyze', out, '--json')
    assert analyzed.code == 0, analyzed.err
    found = analyzed.json['indicators']
    assert analyzed.json['windows'] == 1
    # rounding of the speed to 15 digits aside, 0.2 g at order 1; the strikes leave a percent
    assert found['brg1_ay/amplitude_order_1']['median'] == pytest.approx(0.2 * 9.80665, rel=0.02)
    # without load and disk probes: nothing to say, which is not the same as no alarm
    assert 'load_factor' not in found
    assert analyzed.json['worst_alarm'] == 'STALE'
    again = rig('import', path, '--out', out)
    assert again.code == 2
    assert 'never overwrites' in ' '.join(again.err.split())


@pytest.mark.slow
def test_a_run_up_with_a_sine_tacho_goes_all_the_way(rig: Rig, tmp_path: Path) -> None:
    path, out, windows = (tmp_path / name for name in ('x.txt', 'x.mcap', 'x.json'))
    write_run_up(path)
    options = ['--channel', 'disk_y=1', '--tacho', 2, '--rate-hz', 1280, '--unit', 'um']
    done = rig('import', path, '--out', out, *options)
    assert done.code == 0, done.err
    assert '5.' in done.err.split('shaft:')[1]
    done = rig('analyze', out, '--out', windows, '--json')
    assert done.code == 0, done.err
    records = [row for row in json.loads(windows.read_text()) if row['valid']]
    assert len(records) > 70
    for row in records[2:]:
        # PCHIP between pulses a second apart in the first window, less and less later: 1 %
        assert row['disk_y/amplitude_order_1'] == pytest.approx(3e-6, rel=0.01)
        fourth = row['disk_y/amplitude_order_4']
        # near the end there are few samples a cycle: then no number rather than a wrong one
        assert fourth is None or fourth == pytest.approx(0.5e-6, rel=0.03)
    assert records[len(records) // 2]['disk_y/amplitude_order_4'] is not None


@pytest.mark.slow
def test_without_a_folder_the_figures_say_so_and_end(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, FIGURES, tmp_path / 'none', tmp_path],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0
    assert 'no real data in' in done.stdout
    assert list(tmp_path.iterdir()) == []


INNER = ('InnerRaceFault_vload_1', 'InnerRaceFault_vload_7')
OUTER = ('OuterRaceFault_vload_1', 'OuterRaceFault_vload_7')


@real
@pytest.mark.parametrize('name', [*INNER, *OUTER])
def test_the_faults_of_mfpt_stand_where_they_are_known_to_be(name: str) -> None:
    imported = convert(ImportPlan(REALDATA / 'mfpt' / f'{name}.mat'))
    assert imported.rate_hz == MFPT_RATE_HZ
    assert len(imported.rows) == 3 * MFPT_RATE_HZ
    signal = imported.rows['brg1_ay'].astype(np.float64)
    spectrum = envelope_spectrum(signal, imported.rate_hz, BAND_HZ)
    inner = name in INNER
    own, other = (BPFI, BPFO) if inner else (BPFO, BPFI)
    line = spectrum.line_near(own * 25.0)
    # the README of the data: 4.71-4.72 and 3.20-3.23 times the nominal 25 Hz, rounded
    low, high = (4.705, 4.725) if inner else (3.195, 3.235)
    assert low < line.frequency_hz / 25.0 < high
    assert line.prominence > 20  # noise alone stays below 4
    assert spectrum.line_near(2 * line.frequency_hz, 0.004).prominence > 10
    assert spectrum.line_near(3 * line.frequency_hz, 0.004).prominence > 8
    assert spectrum.line_near(other * 24.75, 0.01).amplitude < line.amplitude / 10
    beside = [spectrum.line_near(line.frequency_hz + side, 0.004) for side in (-24.72, 24.72)]
    depth = sum(each.amplitude for each in beside) / line.amplitude
    # the inner race turns through the load once a revolution, the outer one does not
    assert depth > 0.4 if inner else depth < 0.25
    assert not inner or min(each.prominence for each in beside) > 8


@real
@pytest.mark.slow
def test_the_run_up_has_its_orders_and_its_tone(tmp_path: Path, rig: Rig) -> None:
    path, out, windows = (REALDATA / 'ota_mle_runup' / 'plateVib.txt', tmp_path / 'x.mcap',
                          tmp_path / 'x.json')  # fmt: skip
    options = ['--channel', 'plate_z=1', '--tacho', 2, '--rate-hz', 1280, '--json']
    done = rig('import', path, '--out', out, *options)
    assert done.code == 0, done.err
    # the README of the data: 5 to 60 Hz, 1274 revolutions; a pulse cut off at either end
    assert done.json['samples'] == 50_301
    assert done.json['shaft']['revolutions'] == pytest.approx(1274, abs=1.5)
    assert done.json['shaft']['slowest_hz'] == pytest.approx(5.0, abs=0.5)
    assert done.json['shaft']['fastest_hz'] == pytest.approx(60.0, abs=0.5)
    assert done.json['channels']['plate_z']['unit'] == 'unknown'
    done = rig('analyze', out, '--out', windows, '--json')
    assert done.code == 0, done.err
    rows = [row for row in json.loads(windows.read_text()) if row['valid']]
    speeds_hz = np.array([row['speed_rad_s'] for row in rows]) / (2 * np.pi)

    def order(number: str) -> Any:
        values = [row[f'plate_z/amplitude_order_{number}'] for row in rows]
        return np.array([np.nan if value is None else value for value in values])

    # orders 1 and 4 rule the windows in which nothing fixed crosses them
    free = (speeds_hz > 26) & (speeds_hz < 42)
    assert np.nanmedian(order('1')[free]) > 3 * np.nanmedian(order('2')[free])
    assert np.nanmedian(order('4')[free]) > 10 * np.nanmedian(order('3')[free])
    # the tone near 46 Hz is met by order 2 at half its frequency, by order 1 at all of it
    for number, low, high in (('2', 18.0, 30.0), ('1', 40.0, 50.0)):
        near = (speeds_hz > low) & (speeds_hz < high)
        peak_hz = speeds_hz[near][np.nanargmax(order(number)[near])]
        assert int(number) * peak_hz == pytest.approx(46.0, abs=1.0)


@real
@pytest.mark.slow
def test_the_critical_speed_of_the_rk4_is_found(tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location('real_data_figures', FIGURES)
    assert spec is not None
    assert spec.loader is not None
    figures = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(figures)
    found = figures.bode(REALDATA, tmp_path)
    assert found['peak_um'] == pytest.approx(20.6, abs=0.05)
    assert found['peak_rpm'] == pytest.approx(1665, abs=1)
    steady, swept = (fit for fit in found.values() if isinstance(fit, dict))
    # the authors of the data give 1648 rpm; a run-up moves the peak up, and one mode is a model
    for fit in (steady, swept):
        assert fit['critical_rpm'] == pytest.approx(1648, rel=0.02)
        assert 0.01 < fit['damping_ratio'] < 0.04
        assert fit['phase_across_degrees'] == pytest.approx(180, abs=15)
    # while the speed rises the peak comes late: the mode lies below it
    assert swept['critical_rpm'] < found['peak_rpm']
    assert (tmp_path / 'real_data_bode.png').stat().st_size > 10_000
