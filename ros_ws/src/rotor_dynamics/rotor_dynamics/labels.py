# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Labels of motions: the label of `motion`, checked against the exponent and a run with 2N steps.

A label never contradicts what was computed beside it. Where it would, the motion is undecided and
the reason says why: chaos without an exponent, for a section that looks chaotic may be the jitter
of a jump of f (docs/analyses.md); another motion at 2N steps, as where steps of N let it hop
between coexisting motions.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_dynamics.motion import SIGNIFICANCE, Motion, classify

BATCH = 64
"""Points labelled at once: the 0-1 test of more would take too much memory."""

CHANGES = 'the motion changes with the step'
NO_EXPONENT = 'the section looks chaotic, but there is no exponent to confirm it'


def label_motions(arrays: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return `label`, `reason` and `zero_one` of n points, (n,) each.

    `arrays`: y, z (n, m), exponent, standard_error, diverged_at, steps_per_revolution (n,), and,
    where 2N steps were computed too, finer_y, finer_z, finer_exponent, finer_standard_error.
    """
    count = len(arrays['y'])
    parts = [
        _labelled({name: values[begin : begin + BATCH] for name, values in arrays.items()})
        for begin in range(0, max(count, 1), BATCH)
    ]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _labelled(arrays: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    motion = judge(arrays)
    label, reason = motion.label, motion.reason.astype(object)
    for row in np.flatnonzero(label == 'diverged').tolist():
        reason[row] = f'left the model in revolution {arrays["diverged_at"][row]:.0f}'
    if 'finer_y' in arrays:
        finer = judge(arrays, 'finer_')
        for row in np.flatnonzero(_contradicted(motion, finer)).tolist():
            steps = int(arrays['steps_per_revolution'][row])
            reason[row] = (
                f'{CHANGES}: {_told(motion, row)} with {steps} steps a revolution, '
                f'{_told(finer, row)} with {2 * steps}'
            )
            if label[row] != 'diverged':
                label[row] = 'undecided'
    return {'label': label, 'reason': reason.astype(str), 'zero_one': motion.evidence['zero_one']}


def judge(arrays: Mapping[str, NDArray[Any]], prefix: str = '') -> Motion:
    """Return the motions at N steps or, with the prefix 'finer_', at 2N.

    No motion is chaotic without an exponent that confirms it.
    """
    names = ('y', 'z', 'exponent', 'standard_error')
    motion = classify(*(arrays[f'{prefix}{name}'] for name in names))
    known = np.isfinite(motion.evidence['exponent']) & np.isfinite(
        motion.evidence['standard_error']
    )
    unconfirmed = (motion.label == 'chaotic') & ~known
    return Motion(
        np.where(unconfirmed, 'undecided', motion.label),
        motion.evidence,
        np.where(unconfirmed, NO_EXPONENT, motion.reason),
    )


def _contradicted(coarse: Motion, finer: Motion) -> NDArray[np.bool_]:
    """Return which labels do not hold at 2N steps.

    At 2N steps a decided motion has another label, a chaotic one has an exponent that is not
    positive, or a regular one has a positive exponent.
    """
    exponent, error = finer.evidence['exponent'], finer.evidence['standard_error']
    positive = exponent > SIGNIFICANCE * error  # False for NaN
    other = (finer.label != 'undecided') & (finer.label != coarse.label)
    wrong_sign = (coarse.label != 'diverged') & (positive != (coarse.label == 'chaotic'))
    return np.asarray((coarse.label != 'undecided') & (other | wrong_sign))


def _told(motion: Motion, row: int) -> str:
    exponent, error = (motion.evidence[name][row] for name in ('exponent', 'standard_error'))
    number = f' (exponent {exponent:.4f} +- {error:.4f})' if np.isfinite(exponent) else ''
    return f'{motion.label[row]}{number}'
