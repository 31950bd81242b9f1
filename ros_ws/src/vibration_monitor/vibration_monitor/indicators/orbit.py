# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Loops and flatness of the orbit in each plane."""

from vibration_monitor.indicators.family import Family, Indicator
from vibration_monitor.indicators.window import Window


class Orbit(Family):
    """Shape of the orbit y + i z of the whole orders 1 to 5.

    The orders are taken from the vectors, so the orbit is the synchronous average of the window,
    weighted as the vectors are; it is drawn as a polygon of 128 points.

    | orbit | turns | crossings |
    | --- | --- | --- |
    | circle, ellipse | 1 (backward: -1) | 0 |
    | n inner loops: 1x with a forward (n+1)x, (n+1) A_(n+1) > A_1 | 1 + n | n |
    | n + 1 outer loops: 1x with a backward nx, n A_n > A_1 | -n | n + 1 |
    | figure of eight | 0 | 1 |

    Inner loops at 1/2 (one) and 1/3 (two) of the critical speed are a sign of a breathing crack.
    Turns and crossings are counts: use them to explain an alarm, not as a measure.
    """

    key = 'orbit'
    title = 'Shape of the orbit'
    needs = (
        'Both displacements of a plane, an orbit of `displacement_floor_m` or more, orders up to '
        '5 below half the sample rate; else NaN.'
    )
    fooled_by = (
        'Noise where the direction of motion nearly stops (a cusp: the count flips between '
        'neighbours); any other cause of 2x, since misalignment makes the same loop. Without 1x an '
        'orbit is run through twice a revolution and the crossings mean nothing.'
    )
    source = (
        'Whitney, Compositio Mathematica 4 (1937) 276-284 (turning number); Gasch, Journal of '
        'Sound and Vibration 160 (1993) 313-332 (inner loops of a cracked shaft).'
    )
    of = 'plane'
    more_orders = (1.0, 2.0, 3.0, 4.0, 5.0)
    indicators = (
        Indicator(
            'orbit_turns',
            '1',
            'turning number: full turns of the direction of motion in one revolution, positive in '
            'the sense of rotation',
        ),
        Indicator('orbit_crossings', '1', 'how often the polygon crosses itself'),
        Indicator(
            'orbit_axis_ratio',
            '1',
            '(F - B) / (F + B) at 1x: +1 forward circle, 0 line, -1 backward circle',
        ),
    )

    def compute(self, window: Window) -> list[list[float]]:
        """Return turns, crossings and axis ratio of each plane."""
        from vibration_monitor.orbit_shape import orbit_shape

        places = [window.orders.index(order) for order in self.more_orders]
        rows = []
        for plane in self.sources:
            y, z = window.plane(plane)
            shape = orbit_shape(y[places], z[places], self.config.displacement_floor_m)
            rows.append([shape.turns, shape.crossings, shape.axis_ratio])
        return rows
