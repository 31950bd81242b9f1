# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""An anonymous block has the measurements and nothing else."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotor_bench.evaluation.anonymous import Anonymiser
from rotor_common.errors import WireError
from rotor_interfaces.channels import CHANNEL_COLUMNS
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock
from spy_detector import BLOCK_CHANNELS
from spy_rig import plan, telling_block

RATE_HZ = 10_240
MEASURED = ('angle', *CHANNEL_COLUMNS, 'keyphasor', 'load_y')


def block(first: int, count: int, seed: int = 0) -> WaveformBlock:
    rows = np.zeros(count, WAVEFORM_DTYPE)
    generator = np.random.default_rng([seed, first])
    for name in MEASURED:
        rows[name] = generator.normal(size=count)
    rows['sample'] = first + np.arange(count)
    rows['time'] = np.arange(count) / RATE_HZ
    return WaveformBlock(1_700_000_000_000_000_000 + first, rows, 'rotor')


@given(st.integers(0, 10**12), st.lists(st.integers(1, 400), min_size=1, max_size=5))
def test_measurements_stay_and_the_rest_counts_from_zero(first: int, sizes: list[int]) -> None:
    anonymiser = Anonymiser(RATE_HZ)
    at = first
    for size in sizes:
        given_block = block(at, size)
        copy = anonymiser.copy(given_block)
        assert copy.rows.dtype == WAVEFORM_DTYPE
        for name in MEASURED:
            assert np.array_equal(copy.rows[name], given_block.rows[name])
        assert copy.rows['sample'].tolist() == list(range(at - first, at - first + size))
        assert np.array_equal(copy.rows['time'], np.arange(size) / RATE_HZ)
        assert abs(copy.stamp_ns - (at - first) * 1_000_000_000 / RATE_HZ) <= 0.5
        assert copy.frame_id == 'rotor'
        at += size


def test_the_copy_is_memory_of_its_own() -> None:
    given_block = block(0, 64)
    copy = Anonymiser(RATE_HZ).copy(given_block)
    assert copy.rows.base is None
    assert copy.rows.flags.c_contiguous
    assert not np.shares_memory(copy.rows, given_block.rows)
    assert set(vars(copy)) == {field.name for field in dataclasses.fields(WaveformBlock)}


def test_columns_may_be_more_fewer_and_in_another_order() -> None:
    dtype = [('crack', '<f8'), ('sample', '<f8'), ('disk_z', '<f8'), ('time', '<f8')]
    rows = np.zeros(8, dtype)
    rows['sample'] = np.arange(8)
    rows['disk_z'] = np.arange(8) / 3
    rows['crack'] = 0.1
    copy = Anonymiser(RATE_HZ).copy(WaveformBlock(5, rows))
    assert copy.rows.dtype == WAVEFORM_DTYPE
    assert np.array_equal(copy.rows['disk_z'], (np.arange(8) / 3).astype(np.float32))
    missing = [name for name in MEASURED if name != 'disk_z']
    assert all(np.isnan(copy.rows[name]).all() for name in missing)


@pytest.mark.parametrize('column', ['angle', 'disk_y', 'load_y'])
def test_every_nan_is_the_same(column: str) -> None:
    given_block = block(0, 16)
    bits = np.uint32 if WAVEFORM_DTYPE[column] == np.float32 else np.uint64
    payload = np.bitwise_or(np.array([np.nan], WAVEFORM_DTYPE[column]).view(bits), bits(0x1234))
    given_block.rows[column][3] = payload.view(WAVEFORM_DTYPE[column])[0]
    carried = np.ascontiguousarray(given_block.rows[column]).view(bits)[3]
    assert carried == payload[0], 'the test itself must carry the payload'
    copy = Anonymiser(RATE_HZ).copy(given_block)
    quiet = np.array([np.nan], WAVEFORM_DTYPE[column]).view(bits)[0]
    assert np.ascontiguousarray(copy.rows[column]).view(bits)[3] == quiet
    assert np.isfinite(np.delete(copy.rows[column], 3)).all()


@pytest.mark.parametrize('channel', BLOCK_CHANNELS, ids=lambda channel: channel.__name__)
def test_what_tells_in_a_block_is_silent_in_its_copy(channel: object) -> None:
    assert callable(channel)
    telling = telling_block(plan()[0].flights[1], 0)
    assert channel(telling), 'the block itself must tell'
    assert not channel(Anonymiser(RATE_HZ).copy(telling))


def test_what_makes_no_sense_is_refused() -> None:
    anonymiser = Anonymiser(RATE_HZ)
    anonymiser.copy(block(1000, 10))
    with pytest.raises(WireError, match='before the first'):
        anonymiser.copy(block(990, 10))
    torn = block(2000, 10)
    torn.rows['sample'][5] += 0.5  # K would fit into the fractions
    with pytest.raises(WireError, match='do not follow'):
        anonymiser.copy(torn)
    with pytest.raises(WireError, match='no rows'):
        anonymiser.copy(block(3000, 0))
