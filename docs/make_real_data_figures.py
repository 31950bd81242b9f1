# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Draw the pictures of docs/real_data.md and print its numbers, from recordings of real machines.

Usage: python docs/make_real_data_figures.py [FOLDER [IMAGES]]

FOLDER holds mfpt/, ota_mle_runup/ and rk4_runup_bode/; default: the environment variable
ROTOR_RIG_REALDATA, else ../shared/realdata. Without it the script says so and ends.
"""

import json
import math
import os
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import lfilter

from rotor_recording.importing.convert import ImportPlan, convert
from vibration_monitor import IndicatorRecord, MonitorConfig, VibrationMonitor
from vibration_monitor.envelope import EnvelopeSpectrum, envelope_spectrum
from vibration_monitor.spectrum import weighted

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / 'docs' / 'images'
BLUE, ORANGE, GREEN, GREY = '#0072b2', '#d55e00', '#009e73', '#888888'

MFPT = {
    'InnerRaceFault_vload_1': 'inner race, 0 lb',
    'InnerRaceFault_vload_7': 'inner race, 300 lb',
    'OuterRaceFault_vload_1': 'outer race, 25 lb',
    'OuterRaceFault_vload_7': 'outer race, 300 lb',
}
BANDS_HZ = ((2000.0, 8000.0), (8000.0, 16000.0))
"""Read off the spectra; the first is drawn, the second shows that the choice hardly matters."""

NOMINAL_HZ = 25.0
SLOWEST_HZ, FASTEST_HZ = 24.3, 25.3
RPM = 2 * math.pi / 60

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


def shaft_speed(signal: Real, rate_hz: float, envelope: EnvelopeSpectrum) -> float:
    """Return the speed at which orders 1 to 4 of signal and envelope stand out most, in Hz."""
    amplitudes = np.abs(np.fft.rfft(weighted(signal), 4 * len(signal)))
    frequency_hz = np.arange(len(amplitudes)) * (rate_hz / (4 * len(signal)))
    speeds = np.arange(SLOWEST_HZ, FASTEST_HZ, 0.005)
    score = np.zeros(len(speeds))
    for frequencies, values in (
        (frequency_hz, amplitudes),
        (envelope.frequency_hz, envelope.amplitudes),
    ):
        floor = np.median(values[(frequencies > 15.0) & (frequencies < 110.0)])
        for order in (1, 2, 3, 4):
            score += np.interp(order * speeds, frequencies, values) / floor
    return float(speeds[np.argmax(score)])


def judged(plan: ImportPlan, config: MonitorConfig) -> list[IndicatorRecord]:
    """Return what the monitor says about a file."""
    imported = convert(plan)
    monitor = VibrationMonitor(config)
    return [r for block in imported.blocks() for r in monitor.push(block)]


def mfpt(folder: Path, images: Path) -> dict[str, Any]:
    """Draw the envelope spectra of the bearings; return what stands in them."""
    figure = Figure(figsize=(9.0, 9.0), layout='constrained')
    panels = figure.subplots(4, 1, sharex=True)
    found = {}
    for axes, (name, what) in zip(panels, MFPT.items(), strict=True):
        path = folder / 'mfpt' / f'{name}.mat'
        imported = convert(ImportPlan(path))
        signal = imported.rows['brg1_ay'].astype(np.float64)
        spectra = [envelope_spectrum(signal, imported.rate_hz, band) for band in BANDS_HZ]
        speed_hz = shaft_speed(signal, imported.rate_hz, spectra[0])
        inner = name.startswith('Inner')
        kinematic = 118.875 / 25 if inner else 81.125 / 25
        line = spectra[0].line_near(kinematic * speed_hz)
        lines = [spectra[0].line_near(k * line.frequency_hz, 0.004) for k in (1, 2, 3, 4)]
        sides = [spectra[0].line_near(line.frequency_hz + k * speed_hz, 0.004) for k in (-1, 1)]
        other = 81.125 / 25 if inner else 118.875 / 25
        record = judged(ImportPlan(path, speed_hz=speed_hz), MonitorConfig())[0]
        found[name] = {
            'shaft_hz': speed_hz,
            'line_hz': line.frequency_hz,
            'order_of_measured_speed': line.frequency_hz / speed_hz,
            'order_of_nominal_speed': line.frequency_hz / NOMINAL_HZ,
            'kinematic_order': kinematic,
            'amplitude_m_s2': line.amplitude,
            'prominences_of_harmonics': [round(each.prominence, 1) for each in lines],
            'prominence_other_band': spectra[1].line_near(kinematic * speed_hz).prominence,
            'prominences_of_sidebands': [round(each.prominence, 1) for each in sides],
            'prominence_of_other_race': spectra[0].line_near(other * speed_hz, 0.01).prominence,
            'alarm': record.alarm.level.name,
            'alarm_reasons': record.alarm.reasons,
            **{
                kind: record.value(f'brg1_ay/{kind}')
                for kind in ('amplitude_order_1', 'ratio_2_1', 'ratio_3_1', 'kurtosis')
            },
        }
        axes.plot(spectra[0].frequency_hz, spectra[0].amplitudes, color=BLUE, lw=0.8)
        axes.set_ylim(0, 1.25 * max(each.amplitude for each in lines))
        for k in (1, 2, 3):
            axes.axvline(k * line.frequency_hz, color=ORANGE, ls=':', lw=1)
            axes.text(
                k * line.frequency_hz + 1.5,
                0.97,
                f'{k} x {line.frequency_hz:.2f} Hz',
                color=ORANGE,
                transform=axes.get_xaxis_transform(),
                va='top',
            )
            for side in (-2, -1, 1, 2) if inner else ():
                place = k * line.frequency_hz + side * speed_hz
                axes.axvline(place, color=GREEN, ls=':', lw=0.8)
        axes.set_title(
            f'{what}: shaft {speed_hz:.2f} Hz, line at {line.frequency_hz / speed_hz:.3f} of it '
            f'(kinematics: {kinematic:.3f})'
            + ('; green: 1x and 2x beside each line' if inner else ''),
            fontsize='medium',
            loc='left',
        )
        axes.set_ylabel('envelope [m/s$^2$]')
    panels[-1].set_xlim(0, 400)
    panels[-1].set_xlabel('frequency [Hz]')
    figure.savefig(images / 'real_data_envelope.png', dpi=110, metadata={'Software': None})
    return found


def run_up(folder: Path, images: Path) -> dict[str, Any]:
    """Draw orders over the speed of the run-up; return where the orders and the tone stand."""
    plan = ImportPlan(
        folder / 'ota_mle_runup' / 'plateVib.txt',
        channels={'plate_z': '1'},
        tacho='2',
        rate_hz=1280.0,
    )
    records = [r for r in judged(plan, MonitorConfig()) if r.valid and r.spectrum]
    speeds_hz = np.array([r.value('speed_rad_s') for r in records]) / (2 * math.pi)
    spectra = [r.spectrum for r in records if r.spectrum is not None]
    orders = spectra[0].orders
    amplitudes = np.array([spectrum.amplitudes['plate_z'] for spectrum in spectra])
    figure = Figure(figsize=(9.0, 7.5), layout='constrained')
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[1.3, 1.0])
    mesh = above.pcolormesh(
        speeds_hz,
        orders,
        20 * np.log10(np.maximum(amplitudes.T, 1e-4) / np.nanmax(amplitudes)),
        vmin=-60,
        vmax=0,
        cmap='viridis',
        shading='nearest',
    )
    figure.colorbar(mesh, ax=above, label='dB below the largest')
    tone = tone_hz(speeds_hz, orders, amplitudes)
    above.plot(speeds_hz, tone / speeds_hz, color=ORANGE, ls='--', lw=1, label=f'{tone:.1f} Hz')
    above.set_ylim(0.2, 8)
    above.set_ylabel('order of the shaft')
    above.legend(loc='upper right')
    above.set_title('order spectrum of each window of 64 revolutions', loc='left')
    for order, colour in (('1', BLUE), ('2', GREY), ('4', GREEN)):
        values = [r.value(f'plate_z/amplitude_order_{order}') for r in records]
        below.semilogy(speeds_hz, values, color=colour, label=f'order {order}')
        below.axvline(tone / float(order), color=colour, ls=':', lw=1)
    below.set_ylabel('amplitude [unit not stated]')
    below.set_xlabel('mean shaft speed of the window [Hz]')
    below.legend(loc='upper left')
    below.set_title('dotted: where the fixed tone crosses that order', loc='left')
    figure.savefig(images / 'real_data_run_up.png', dpi=110, metadata={'Software': None})
    away = np.abs(speeds_hz - tone / 4) > 3
    strength = np.nanmedian(amplitudes[away], axis=0)
    whole = {k: float(strength[np.argmin(np.abs(orders - k))]) for k in range(1, 8)}
    return {
        'windows': len(records),
        'speeds_hz': [float(speeds_hz[0]), float(speeds_hz[-1])],
        'tone_hz': tone,
        'median_amplitude_of_orders': whole,
        'median_floor': float(np.nanmedian(strength)),
        'largest_ratio_2.5_1': max(
            (r.value('plate_z/ratio_2.5_1'), r.value('speed_rad_s') / (2 * math.pi))
            for r in records
        ),
    }


def tone_hz(speeds_hz: Real, orders: Real, amplitudes: Real) -> float:
    """Return the fixed frequency that is strongest over all windows, between 30 and 60 Hz."""
    frequencies = np.arange(30.0, 60.0, 0.1)
    total = np.zeros(len(frequencies))
    for speed_hz, row in zip(speeds_hz, amplitudes, strict=True):
        at = np.interp(frequencies / speed_hz, orders, row, right=math.nan)
        # shaft orders are no fixed tone
        near = np.abs(frequencies / speed_hz - np.round(frequencies / speed_hz)) < 0.15
        total += np.where(near | ~np.isfinite(at), 0.0, at)
    return float(frequencies[np.argmax(total)])


def steady(p: Real, speed: Real) -> Complex:
    """Return the 1x vector of one mode at steady speed, and a constant runout."""
    natural, damping = p[0], p[1]
    gain = speed**2 / (natural**2 - speed**2 + 2j * damping * natural * speed)
    result: Complex = complex(p[2], p[3]) * gain + complex(p[4], p[5])
    return result


def swept(p: Real, speed: Real) -> Complex:
    """Return the same while the speed rises at p[6] rad/s^2, exact but for linear interpolation.

    z'' + 2 d w z' + w^2 z = e (W^2 - i a) exp(i angle), by its two poles.
    """
    natural, damping, rise = p[0], p[1], p[6]
    start, step = 1000 * RPM, 5e-4
    time = np.arange(int((speed[-1] - start) / rise / step) + 3) * step
    now = start + rise * time
    turn = np.exp(1j * (start * time + rise * time**2 / 2))
    force = complex(p[2], p[3]) * (now**2 - 1j * rise) * turn
    damped = natural * math.sqrt(1 - damping**2)
    response = np.zeros(len(time), np.complex128)
    for sign in (1, -1):
        pole = -damping * natural + 1j * sign * damped
        x = pole * step
        decay = np.exp(x)
        driven = (decay - 1 - x) / x**2 * step * force
        driven[1:] += (decay * (x - 1) + 1) / x**2 * step * force[:-1]
        driven[0] = force[0] / (1j * start - pole)
        response += lfilter([1.0], [1.0, -decay], driven) / (2j * sign * damped)
    vector = response / turn
    at = np.interp(speed, now, vector.real) + 1j * np.interp(speed, now, vector.imag)
    result: Complex = at + complex(p[4], p[5])
    return result


def fit(model: Any, speed: Real, vector: Complex, start: Real) -> tuple[Real, float]:
    """Return the parameters and the RMS of what is left, by least squares of the vectors."""

    def left(p: Real) -> Real:
        rest = model(p, speed) - vector
        return np.concatenate([rest.real, rest.imag])

    solved = least_squares(left, start, x_scale=np.array([1, 0.01, 1, 1, 1, 1, 1])[: len(start)])
    return solved.x, math.sqrt(2 * solved.cost / len(speed))


def bode(folder: Path, images: Path) -> dict[str, Any]:
    """Draw the Bode plot of the RK-4 with both fits; return their numbers."""
    path = folder / 'rk4_runup_bode' / 'runup_bode_excerpt.csv'
    table = np.genfromtxt(path, delimiter=',', names=True)
    rpm = table['rpm']
    speed = rpm * RPM
    vector = table['amp_1x_um'] * np.exp(1j * np.radians(table['phase_1x_deg']))
    start = np.array([1630 * RPM, 0.02, -0.3, 0.8, 0.0, 0.0, 12.0])
    rising = rpm < 1700
    fits = {
        'one mode, steady speed, below 1700 rpm': (
            steady, *fit(steady, speed[rising], vector[rising], start[:6]),
        ),
        'one mode, rising speed, all points': (swept, *fit(swept, speed, vector, start)),
    }  # fmt: skip
    figure = Figure(figsize=(9.0, 6.5), layout='constrained')
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(rpm, np.abs(vector), 'o', color=BLUE, ms=4, label='measured')
    below.plot(rpm, np.degrees(np.unwrap(np.angle(vector))), 'o', color=BLUE, ms=4)
    fine = np.linspace(1030, 2600, 1500) * RPM
    found: dict[str, Any] = {
        'peak_um': float(np.abs(vector).max()),
        'peak_rpm': float(rpm[np.argmax(np.abs(vector))]),
    }
    for (name, (model, p, rest)), colour in zip(fits.items(), (ORANGE, GREEN), strict=True):
        curve = model(p, fine)
        above.plot(fine / RPM, np.abs(curve), color=colour, lw=1, label=name)
        below.plot(fine / RPM, np.degrees(np.unwrap(np.angle(curve))), color=colour, lw=1)
        found[name] = {
            'critical_rpm': p[0] / RPM,
            'damping_ratio': p[1],
            'eccentricity_um': abs(complex(p[2], p[3])),
            'runout_um': abs(complex(p[4], p[5])),
            'rise_rad_s2': p[6] if len(p) > 6 else 0.0,
            'rms_left_um': rest,
            'phase_across_degrees': float(
                np.ptp(np.degrees(np.unwrap(np.angle(curve - complex(p[4], p[5])))))
            ),
        }
    above.set_ylabel('1x amplitude [um]')
    above.legend()
    below.set_ylabel('1x phase [degrees]')
    below.set_xlabel('speed [rpm]')
    figure.savefig(images / 'real_data_bode.png', dpi=110, metadata={'Software': None})
    return found


def main(folder: Path, images: Path) -> None:
    """Draw everything into `images`, print the numbers."""
    if not (folder / 'mfpt').is_dir():
        print(f'no real data in {folder}: give the folder, or set ROTOR_RIG_REALDATA')  # noqa: T201
        return
    mpl.rcParams.update({'font.size': 9, 'axes.grid': True, 'grid.alpha': 0.3})
    images.mkdir(parents=True, exist_ok=True)
    found = {draw.__name__: draw(folder, images) for draw in (mfpt, run_up, bode)}
    print(json.dumps(found, indent=1))  # noqa: T201


if __name__ == '__main__':
    default = os.environ.get('ROTOR_RIG_REALDATA', ROOT.parent / 'shared' / 'realdata')
    given = [Path(text) for text in sys.argv[1:]]
    main(given[0] if given else Path(default), given[1] if len(given) > 1 else IMAGES)
