# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Draw the picture of docs/library.md: what its first lines plot."""

from pathlib import Path

import matplotlib as mpl

mpl.use('Agg')

from matplotlib import pyplot as plt

import rotor_rig as rig


def main() -> None:
    """Write docs/images/library.png."""
    flight = rig.simulate(rig.scenario('climb_dive', crack_stiffness_ratio=0.15), duration_s=20)
    figure, (above, below) = plt.subplots(2, 1, figsize=(8.0, 6.0), layout='constrained')
    flight.disk_z.plot(ax=above, linewidth=0.3)
    rig.monitor(flight).crack_ratio.plot(ax=below, marker='.')
    path = Path(__file__).parent / 'images' / 'library.png'
    figure.savefig(path, dpi=100, metadata={'Software': None})


if __name__ == '__main__':
    main()
