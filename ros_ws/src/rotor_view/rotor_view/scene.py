# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The 3D scene: shaft, disk with its crack side, two ball bearings.

Frame `rotor`: x along the shaft, forward; y along the load, down; z to the left. Radii of the
bearings are true, lengths are drawn as they look best, displacements are exaggerated.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from rotor_common.units import number_text
from rotor_view import style
from rotor_view.curves import time_column
from rotor_view.style import EXAGGERATION, RIG, Colour

HALF_LENGTH_M = 0.30
SHAFT_RADIUS_M = 0.022
DISK_RADIUS_M = 0.15
DISK_WIDTH_M = 0.05
RING_WIDTH_M = 0.03
LOAD_ARROW_M_PER_G = 0.04
POSE_EVERY = 8
"""Every 8th sample has a pose: at 352 rad/s about 23 a revolution, enough for slow motion."""

MOST_BALLS = 100
_SEGMENTS = 72
_BALL: Colour = (215, 220, 230)
_OUTER_RING: Colour = (95, 105, 120)
_INNER_RING: Colour = (120, 135, 160)
_HEAVY_SPOT: Colour = (240, 240, 245)


@dataclass(frozen=True)
class Geometry:
    """What the scene needs to know of the rotor; the defaults are those of the paper."""

    crack_angle_rad: float = np.pi / 3
    crack_half_angle_rad: float = np.pi / 6
    ball_count: int = 8
    inner_radius_m: float = 0.0401
    outer_radius_m: float = 0.0639

    def __post_init__(self) -> None:
        """Raise ValueError for what cannot be drawn."""
        if not SHAFT_RADIUS_M < self.inner_radius_m < self.outer_radius_m < DISK_RADIUS_M:
            raise ValueError('the radii of the ball bearings do not fit')
        if not (isinstance(self.ball_count, int) and 1 <= self.ball_count <= MOST_BALLS):
            raise ValueError(f'{self.ball_count} balls')
        if not (math.isfinite(self.crack_angle_rad) and 0 < self.crack_half_angle_rad < math.pi):
            raise ValueError('the angles of the crack are out of range')

    @property
    def cage_ratio(self) -> float:
        """Cage angle per shaft angle: r_i / (r_i + r_o)."""
        return self.inner_radius_m / (self.inner_radius_m + self.outer_radius_m)

    @classmethod
    def from_config(cls, config: Any) -> 'Geometry':
        """Return the geometry in a `rotor/config` document, whose keys may be at any depth.

        Raises ValueError for numbers that cannot be drawn.
        """
        found = {name: _find(config, name) for name in cls.__dataclass_fields__}
        return cls(**{name: value for name, value in found.items() if value is not None})


def _find(document: Any, name: str) -> Any:
    """Return the first number called `name` in nested mappings and lists, or None.

    The section `monitor` is skipped: it holds the monitor's settings, not the rotor's.
    """
    if isinstance(document, Mapping):
        value = document.get(name)
        if isinstance(value, int | float) and not isinstance(value, bool):
            return value
        document = [value for key, value in document.items() if key != 'monitor']
    if isinstance(document, list):
        for item in document:
            value = _find(item, name)
            if value is not None:
                return value
    return None


def ring(
    inner_m: float,
    outer_m: float,
    width_m: float,
    colour: Colour,
    sector_rad: tuple[float, float] = (0.0, 2.0 * np.pi),
) -> rr.Mesh3D:
    """Return a ring about x, or the sector of it between two angles from y towards z."""
    start, stop = sector_rad
    count = max(2, round(_SEGMENTS * (stop - start) / (2.0 * np.pi)))
    angle = np.linspace(start, stop, count + 1)
    profile = [(-0.5, inner_m), (0.5, inner_m), (0.5, outer_m), (-0.5, outer_m)]
    edges = [
        np.stack(
            [np.full_like(angle, side * width_m), radius * np.cos(angle), radius * np.sin(angle)],
            axis=1,
        )
        for side, radius in profile
    ]
    corners, normals = [], []
    for near, far in zip(edges, edges[1:] + edges[:1], strict=True):
        quads = np.stack([near[:-1], far[:-1], far[1:], near[:-1], far[1:], near[1:]], axis=1)
        normal = np.cross(quads[:, 1] - quads[:, 0], quads[:, 2] - quads[:, 0])
        flat = np.linalg.norm(normal, axis=1) < 1e-12  # an inner radius of 0 has no inner face
        normal = normal[~flat] / np.linalg.norm(normal[~flat], axis=1, keepdims=True)
        corners.append(quads[~flat].reshape(-1, 3))
        normals.append(np.repeat(normal, 6, axis=0))
    positions = np.concatenate(corners)
    return rr.Mesh3D(
        vertex_positions=positions,
        vertex_normals=np.concatenate(normals),
        vertex_colors=np.tile(np.array(colour, np.uint8), (len(positions), 1)),
    )


def log_bodies(stream: rr.RecordingStream, geometry: Geometry) -> None:
    """Log the shapes of the bodies once, each in its own frame."""

    def static(path: str, *what: Any) -> None:
        stream.log(f'{RIG}/{path}', *what, static=True)

    static('', rr.ViewCoordinates.FDL)
    static('disk/body', ring(SHAFT_RADIUS_M, DISK_RADIUS_M, DISK_WIDTH_M, style.STEEL))
    static(
        'disk/heavy_spot',
        rr.Points3D(
            [[side * DISK_WIDTH_M / 2, 0.86 * DISK_RADIUS_M, 0.0] for side in (-1, 1)],
            radii=0.008,
            colors=_HEAVY_SPOT,
        ),
    )
    middle_m = (geometry.inner_radius_m + geometry.outer_radius_m) / 2
    angles = 2.0 * np.pi * np.arange(geometry.ball_count) / geometry.ball_count
    balls = np.stack([0 * angles, middle_m * np.cos(angles), middle_m * np.sin(angles)], axis=1)
    for number, side in ((1, -1.0), (2, 1.0)):
        place = rr.Transform3D(translation=[side * HALF_LENGTH_M, 0.0, 0.0])
        static(f'bearing_{number}', place)
        static(
            f'bearing_{number}/outer',
            ring(geometry.outer_radius_m, geometry.outer_radius_m + 0.012, RING_WIDTH_M,
                 _OUTER_RING),
        )  # fmt: skip
        static(
            f'bearing_{number}/inner',
            ring(SHAFT_RADIUS_M, geometry.inner_radius_m, RING_WIDTH_M, _INNER_RING),
        )
        static(
            f'bearing_{number}/balls',
            rr.Points3D(
                balls,
                radii=(geometry.outer_radius_m - geometry.inner_radius_m) / 2,
                colors=_BALL,
            ),
        )
        static(
            f'shaft_{number}/body',
            rr.Cylinders3D(
                lengths=HALF_LENGTH_M,
                radii=SHAFT_RADIUS_M,
                centers=[-side * HALF_LENGTH_M / 2, 0.0, 0.0],
                rotation_axis_angles=rr.RotationAxisAngle([0, 1, 0], degrees=90),
                colors=style.STEEL,
                fill_mode='solid',
            ),
        )


def log_crack(stream: rr.RecordingStream, geometry: Geometry, stiffness_ratio: float) -> None:
    """Mark the crack side on the disk in red, wider than the disk; nothing where K is 0."""
    path = f'{RIG}/disk/crack'
    if not stiffness_ratio > 0.0:
        stream.log(path, rr.Clear(recursive=False))
        return
    sector = (
        geometry.crack_angle_rad - geometry.crack_half_angle_rad,
        geometry.crack_angle_rad + geometry.crack_half_angle_rad,
    )
    stream.log(
        path,
        ring(SHAFT_RADIUS_M, 1.02 * DISK_RADIUS_M, 1.1 * DISK_WIDTH_M, style.CRACK_COLOUR, sector),
    )


def _about_x(angle_rad: NDArray[np.float64]) -> NDArray[np.float32]:
    half = np.remainder(angle_rad, 4.0 * np.pi) / 2.0
    zero = np.zeros_like(half)
    return np.stack([np.sin(half), zero, zero, np.cos(half)], axis=1).astype(np.float32)


def send_poses(
    stream: rr.RecordingStream,
    geometry: Geometry,
    offsets_ns: NDArray[np.int64],
    rows: NDArray[np.void],
) -> None:
    """Send the poses of all moving bodies at the given rows (one pose each, exaggerated).

    A body whose columns the source does not send, or whose values are NaN, stays where it is.
    """

    def send(path: str, **columns: NDArray[np.float32]) -> None:
        whole = np.all([np.isfinite(c).all(axis=1) for c in columns.values()], axis=0)
        if whole.any():
            poses: dict[str, Any] = {name: c[whole] for name, c in columns.items()}
            times = time_column(offsets_ns[whole])
            stream.send_columns(f'{RIG}/{path}', [times], rr.Transform3D.columns(**poses))

    turn: dict[str, NDArray[np.float32]] = {}
    if 'angle' in (rows.dtype.names or ()) and np.isfinite(rows['angle']).all():
        angle = rows['angle'].astype(np.float64)
        turn = {'quaternion': _about_x(angle)}
        for number in (1, 2):
            send(f'bearing_{number}/balls', quaternion=_about_x(angle * geometry.cage_ratio))
    disk = displacement(rows, 'disk')
    if disk is not None:
        send('disk', translation=disk, **turn)
    for number, side in ((1, -1.0), (2, 1.0)):
        bearing = displacement(rows, f'brg{number}')
        if bearing is None:
            continue
        send(f'bearing_{number}/inner', translation=bearing, **turn)
        if disk is not None:
            far_end = np.array([side * HALF_LENGTH_M, 0.0, 0.0], np.float32)
            send(f'shaft_{number}', translation=bearing + far_end, **_bend(side, disk - bearing))


def _bend(side: float, drop_m: NDArray[np.float32]) -> dict[str, NDArray[np.float32]]:
    """Return rotation and stretch of the shaft half from a bearing to a disk `drop_m` beside it.

    The half lies along x from its origin at the bearing (side -1 aft, 1 forward) to the disk.
    """
    slope = drop_m / (-side * HALF_LENGTH_M)
    stretch = np.sqrt(1.0 + slope[:, 1] ** 2 + slope[:, 2] ** 2)
    turn = np.stack([0 * stretch, -slope[:, 2], slope[:, 1], 1.0 + stretch], axis=1)
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    one = np.ones_like(stretch)
    return {'quaternion': turn, 'scale': np.stack([stretch, one, one], axis=1)}


def displacement(rows: NDArray[np.void], point: str) -> NDArray[np.float32] | None:
    """Return exaggerated (0, y, z) of a point in m, or None where the source has no such point."""
    names = rows.dtype.names or ()
    if f'{point}_y' not in names or f'{point}_z' not in names:
        return None
    y, z = rows[f'{point}_y'], rows[f'{point}_z']
    return np.stack([0 * y, y * EXAGGERATION, z * EXAGGERATION], axis=1).astype(np.float32)


def log_load(stream: rr.RecordingStream, load_factor: float, crack_ratio: float | None) -> None:
    """Draw the load as an arrow on the disk and write what the picture shows (NaN: unknown)."""
    if math.isfinite(load_factor):
        length_m = LOAD_ARROW_M_PER_G * load_factor
        arrow = rr.Arrows3D(
            origins=[[0.0, -1.15 * DISK_RADIUS_M - max(length_m, 0.0), 0.0]],
            vectors=[[0.0, length_m, 0.0]],
            colors=style.LOAD_COLOUR,
            radii=0.006,
        )
        stream.log(f'{RIG}/load', arrow)
    else:
        stream.log(f'{RIG}/load', rr.Clear(recursive=False))
    crack = 'unknown' if crack_ratio is None else f'K = {crack_ratio:.3g}'
    load = f'n = {number_text(load_factor, ".1f")}'
    stream.log(
        f'{RIG}/text',
        rr.Points3D(
            [[0.0, 0.26, 0.0]],
            radii=0.0,
            colors=style.PALE,
            labels=f'displacements x {EXAGGERATION:g}; {load}; crack {crack}',
            show_labels=True,
        ),
    )


class Rig:
    """The rotor of one run; drawn only if its geometry is known and its disk is measured."""

    def __init__(self, stream: rr.RecordingStream) -> None:
        self.drawn: set[str] = set()
        """Entities that have something to show."""
        self.geometry: Geometry | None = None
        """From the run's configuration; None before it, and for other machines."""
        self._stream = stream
        self._bodies: Geometry | None = None
        self._crack_ratio: float | None = None

    def set_crack(self, stiffness_ratio: float) -> None:
        """Take the true crack, at the time that is set on the stream."""
        if stiffness_ratio != self._crack_ratio:
            self._crack_ratio = stiffness_ratio
            if self._bodies is not None:
                log_crack(self._stream, self._bodies, stiffness_ratio)

    def send(self, offsets_ns: NDArray[np.int64], rows: NDArray[np.void]) -> None:
        """Send the poses at these rows."""
        disk = displacement(rows, 'disk')
        if self.geometry is None or disk is None or not np.isfinite(disk).all(axis=1).any():
            return
        if self._bodies != self.geometry:
            self._bodies = self.geometry
            self.drawn.add(RIG)
            log_bodies(self._stream, self.geometry)
            if self._crack_ratio is not None:
                log_crack(self._stream, self.geometry, self._crack_ratio)
        send_poses(self._stream, self.geometry, offsets_ns, rows)

    def draw_load(self, load_factor: float) -> None:
        """Draw the load at the time that is set on the stream; NaN: not known."""
        if self._bodies is not None:
            log_load(self._stream, load_factor, self._crack_ratio)
