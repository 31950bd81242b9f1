# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A suite of a minute of flight, for the tests of what is done with suites."""

import hashlib
from pathlib import Path

TINY = """
base: smoke
name: tiny
flight_s: 10.1    # ends with half a block
growth_s: 12.0
settle_revolutions: 20
groups:
  - {name: train, split: train, machines: 2, healthy: 1, cracked: 1, growing: 0, held_out: false,
     noise: [realistic]}
  - {name: growth, split: test, machines: 1, healthy: 0, cracked: 0, growing: 1, held_out: true,
     noise: [noisy]}
references:
  - {family: pulls_5g, speed_program: sweep}
confounders: [sensor_fault]
sensors: {faults: [probe_dropouts], fault_dropouts_per_s: 2.0}
"""


def write_tiny(folder: Path) -> str:
    """Return the path of the suite, written into `folder`."""
    path = folder / 'tiny.yaml'
    path.write_text(TINY)
    return str(path)


def tree(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of every file below a folder by its relative path."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob('*'))
        if path.is_file()
    }
