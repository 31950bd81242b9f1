# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Draw docs/images/saltation.png: what a fixed step over a jump does to chaos and exponents.

    python docs/make_saltation_figure.py [FILE.png]

`figure_chaos` at 352 rad/s, G = 3, for several cracks: exponents with and without saltation, and
the 0-1 test of the section, with more and more steps a revolution. Prints the same as a table.
"""

import math
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rotor_dynamics import Ensemble, OperatingPoint
from rotor_dynamics.lyapunov import estimate
from rotor_dynamics.motion import zero_one_test
from rotor_dynamics.surveys import tangent_growth
from rotor_sim import RotorParameters

CRACKS = (0.1875, 0.2, 0.2125, 0.225)
STEPS = (256, 512, 1024, 2048, 4096)
TRANSIENT, REVOLUTIONS = 400, 300

Array = NDArray[np.float64]


def measure(steps: int) -> dict[str, Array]:
    """Return the 0-1 test and both exponents at CRACKS with `steps` a revolution."""
    points = [
        OperatingPoint(RotorParameters.hou2016('figure_chaos', crack_stiffness_ratio=K), 352.0, 3.0)
        for K in CRACKS
    ]
    settling = Ensemble(points, steps)
    settling.advance(TRANSIENT)
    start = settling.states
    found = {'0-1 test': zero_one_test(settling.advance(REVOLUTIONS, 1)[:, :, 1])}
    for name, saltation in (('with saltation', True), ('without', False)):
        ensemble = Ensemble(points, steps, start, TRANSIENT)
        logs = tangent_growth(ensemble, REVOLUTIONS, saltation=saltation)
        found[name] = estimate(logs[:, :, 0], 2.0 * math.pi, discard=REVOLUTIONS // 10).exponent
    return found


def main() -> None:
    """Compute, print and draw."""
    default = Path(__file__).parent / 'images' / 'saltation.png'
    file = Path(sys.argv[1]) if len(sys.argv) > 1 else default
    rows = [measure(steps) for steps in STEPS]
    figure = Figure(figsize=(11, 3.6), layout='constrained')
    left, right = figure.subplots(1, 2)
    for i, crack in enumerate(CRACKS):
        colour = f'C{i}'
        exponents = [[row[name][i] for row in rows] for name in ('with saltation', 'without')]
        left.semilogx(STEPS, exponents[0], 'o-', color=colour, base=2, label=f'K = {crack:g}')
        left.semilogx(STEPS, exponents[1], 'o--', color=colour, base=2, alpha=0.5)
        right.semilogx(STEPS, [row['0-1 test'][i] for row in rows], 'o-', color=colour, base=2)
        print(f'K = {crack:g}')  # noqa: T201 - a script for the page
        for steps, row in zip(STEPS, rows, strict=True):
            numbers = ', '.join(f'{name} {values[i]:.4f}' for name, values in row.items())
            print(f'  {steps} steps: {numbers}')  # noqa: T201
    left.axhline(0.0, color='grey', linewidth=0.8)
    left.set_ylabel('largest exponent per unit tau')
    left.set_title('solid: with saltation, dashed: without')
    left.legend(fontsize='small')
    right.set_ylabel('K of the 0-1 test')
    right.set_title('0 = regular, 1 = chaotic')
    for axes in (left, right):
        axes.set_xlabel('steps a revolution')
        axes.set_xticks(STEPS, [str(steps) for steps in STEPS])
    figure.suptitle(
        "figure_chaos (empirical reconstruction, not the authors' code), G = 3, 352 rad/s"
    )
    figure.savefig(file, dpi=110)


if __name__ == '__main__':
    main()
