# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Finished flights are kept, taken up again, and only by the evaluation that they belong to."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

import spy_rig
from rotor_bench.dataset.suite import Flight
from rotor_bench.evaluation import runner
from rotor_bench.evaluation.checkpoint import Parts, key_of
from rotor_bench.evaluation.outcome import Evaluated
from rotor_bench.evaluation.suites import load
from rotor_common.errors import ConfigError
from rotor_interfaces.waveform import WaveformBlock

NAMES = ['faulty_detectors:Sound', 'faulty_detectors:Silent', 'faulty_detectors:RaisesLater']
DETECTOR = '"""A detector."""\n'


class Counting(spy_rig.TellingSource):
    """Notes what is flown, and stops before flight `until`."""

    def __init__(self, until: int = 99) -> None:
        self.until = until
        self.flown: list[int] = []

    def fly(self, flights: Sequence[Flight]) -> Iterator[list[WaveformBlock]]:
        if flights[0].number >= self.until:
            raise KeyboardInterrupt
        self.flown.append(flights[0].number)
        yield from super().fly(flights)


@pytest.mark.slow
def test_what_is_finished_is_not_flown_again_and_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(Path(__file__).parent)
    machines = spy_rig.plan()[:2]
    parts = Parts(tmp_path / 'parts', 'key')
    first, second, whole, third = Counting(until=3), Counting(), Counting(), Counting()
    with pytest.raises(KeyboardInterrupt):
        runner.evaluate(machines, NAMES, first, parts=parts)
    assert first.flown == [0, 1, 2]
    assert parts.clean() == (4, 0)
    told: list[float] = []
    resumed = runner.evaluate(
        machines, NAMES, second, parts=parts, on_flights=lambda _, seconds: told.append(seconds)
    )
    assert second.flown == [0, 3, 4, 5, 6, 7, 8]  # the reference, which the others need
    assert sum(told) == pytest.approx(2 * 9 * 0.2)  # the bar comes to its end
    in_one_go = runner.evaluate(machines, NAMES, whole)
    assert whole.flown == list(range(9))
    assert str(resumed) == str(in_one_go)  # NaN is not equal to itself
    again = runner.evaluate(machines, NAMES, third, parts=parts)
    assert third.flown == []
    assert str(again) == str(in_one_go)
    parts.remove()
    assert not parts.folder.exists()


def test_only_parts_of_the_same_key_are_taken(tmp_path: Path) -> None:
    flights = [machine.flights[1] for machine in spy_rig.plan()]
    kept = Evaluated([], 'some', {'a': 1.0})
    ours, other = (Parts(tmp_path / 'parts', key) for key in ('ours', 'other'))
    assert ours.clean() == (0, 0)
    ours.store(flights, kept)
    assert ours.load(flights) == kept
    assert other.load(flights) is None
    (damaged,) = ours.folder.iterdir()
    unfinished = damaged.with_name(damaged.name + '.tmp')
    foreign = ours.folder / 'notes.json'
    for path, text in ((unfinished, '{'), (foreign, '{}')):
        path.write_text(text)
    assert other.clean() == (0, 1)
    assert list(ours.folder.iterdir()) == [foreign]
    damaged.write_text('{"key": "ours"')
    assert ours.load(flights) is None
    assert ours.clean() == (0, 1)
    ours.remove()
    assert list(ours.folder.iterdir()) == [foreign]


def test_a_disk_that_takes_nothing_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / 'parts').write_text('a file')
    with pytest.raises(ConfigError, match='finished flights cannot be kept'):
        Parts(tmp_path / 'parts', 'key').store(spy_rig.plan()[0].flights[:1], Evaluated([], '', {}))


@pytest.mark.slow
def test_the_key_holds_everything_that_decides(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    module = tmp_path / 'own_detector_of_a_user.py'
    module.write_text(DETECTOR)
    own = f'{module.stem}:Thing'
    (tmp_path / 'other.yaml').write_text('{base: smoke, changes: {eccentricity_factor: [3, 4]}}')

    def key(
        detectors: Sequence[str] = ('ratios', own),
        suite: str = 'smoke',
        seed: int = 0,
        split: str = 'test',
        limit: int | None = None,
    ) -> str:
        return key_of(load(suite, seed=seed, split=split, limit=limit), detectors)

    usual = key()
    assert key() == usual
    assert key(limit=100) == usual  # no limit at all
    changed = [
        key(('ratios',)), key(('zones', own)), key(suite='other.yaml'), key(seed=1),
        key(split='train'), key(limit=3),
    ]  # fmt: skip
    module.write_text(DETECTOR + 'LIMIT = 3\n')
    changed.append(key())
    assert len({usual, *changed}) == 8
