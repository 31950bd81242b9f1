# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Format numbers with the units that people use."""

import math


def people_unit(unit: str) -> tuple[str, float]:
    """Return the display unit for a unit of the wire, and the factor to it."""
    return ('um', 1e6) if unit == 'm' else (unit, 1.0)


def number_text(value: float, form: str, unit: str = '') -> str:
    """Return a number formatted by `form`, with its unit; '-' if it is not finite."""
    return f'{value:{form}} {unit}'.rstrip() if math.isfinite(value) else '-'
