# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Security that is asked for and not there ends a command before it publishes; the policy."""

import ast
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from live_flight import CLI, private_environment

from rotor_bench.evaluation import topic
from rotor_common.errors import ConfigError
from rotor_interfaces import access
from rotor_interfaces.topics import TOPICS

SOURCES = Path(__file__).resolve().parents[1] / 'ros_ws' / 'src'
POLICY = SOURCES / 'rotor_bringup' / 'security' / 'policy.xml'
VARIABLES = ('ENABLE', 'STRATEGY', 'KEYSTORE', 'ENCLAVE_OVERRIDE')


def ask(monkeypatch: pytest.MonkeyPatch, **given: str) -> None:
    for name in VARIABLES:
        monkeypatch.delenv(f'ROS_SECURITY_{name}', raising=False)
    for name, value in given.items():
        monkeypatch.setenv(f'ROS_SECURITY_{name}', value)


@pytest.fixture
def keystore(tmp_path: Path) -> str:
    (tmp_path / 'keys' / 'enclaves' / 'rotor_rig').mkdir(parents=True)
    return str(tmp_path / 'keys')


@pytest.mark.parametrize('enabled', ['', 'false'])
def test_no_security_is_asked_for(monkeypatch: pytest.MonkeyPatch, enabled: str) -> None:
    ask(monkeypatch, ENABLE=enabled, STRATEGY='Enforce')
    access.check_security()


@pytest.mark.parametrize('enabled', ['True', 'TRUE', '1', 'yes', ' true', 'on', 'False'])
def test_a_word_that_ros_does_not_know_is_refused(
    monkeypatch: pytest.MonkeyPatch, enabled: str
) -> None:
    ask(monkeypatch, ENABLE=enabled)
    with pytest.raises(ConfigError, match='ROS_SECURITY_ENABLE') as refused:
        access.check_security()
    assert repr(enabled) in str(refused.value)
    assert "must be 'true' or 'false'" in str(refused.value)


@pytest.mark.parametrize('strategy', ['', 'Permissive', 'enforce', 'ENFORCE', 'Enforce '])
def test_a_strategy_that_would_fly_unsecured_is_refused(
    monkeypatch: pytest.MonkeyPatch, keystore: str, strategy: str
) -> None:
    given = {'KEYSTORE': keystore, 'ENCLAVE_OVERRIDE': '/rotor_rig'}
    ask(monkeypatch, ENABLE='true', STRATEGY=strategy, **given)
    with pytest.raises(ConfigError, match=f'ROS_SECURITY_STRATEGY = {strategy!r} is not allowed'):
        access.check_security()


@pytest.mark.parametrize('path', ['', '/nowhere/at/all', 'keys'])
def test_a_keystore_that_is_none_is_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, path: str
) -> None:
    (tmp_path / 'keys').mkdir()
    monkeypatch.chdir(tmp_path)
    ask(monkeypatch, ENABLE='true', STRATEGY='Enforce', KEYSTORE=path)
    with pytest.raises(ConfigError, match=f'ROS_SECURITY_KEYSTORE = {path!r} is no keystore'):
        access.check_security()


@pytest.mark.parametrize('enclave', ['', '/other', 'rotor_rig'])
def test_an_enclave_that_is_none_is_refused(
    monkeypatch: pytest.MonkeyPatch, keystore: str, enclave: str
) -> None:
    given = {'KEYSTORE': keystore, 'ENCLAVE_OVERRIDE': enclave}
    ask(monkeypatch, ENABLE='true', STRATEGY='Enforce', **given)
    with pytest.raises(ConfigError, match=f'ROS_SECURITY_ENCLAVE_OVERRIDE = {enclave!r} is no enc'):
        access.check_security()


def test_keys_that_no_node_starts_with_are_refused(
    monkeypatch: pytest.MonkeyPatch, keystore: str
) -> None:
    """In the wheels for want of security in Fast DDS, elsewhere for want of the files."""
    ask(
        monkeypatch,
        ENABLE='true',
        STRATEGY='Enforce',
        KEYSTORE=keystore,
        ENCLAVE_OVERRIDE='/rotor_rig',
    )
    with pytest.raises(ConfigError, match='a secured node does not start') as refused:
        access.check_security()
    assert 'error creating node' in str(refused.value)
    assert '\n' not in str(refused.value)


def test_nothing_is_evaluated_over_dds(monkeypatch: pytest.MonkeyPatch) -> None:
    ask(monkeypatch, ENABLE='true')
    with pytest.raises(ConfigError, match='ROS_SECURITY_STRATEGY'):
        topic.follow([], topic.TestedNode('alarm'), None)  # type: ignore[arg-type]


COMMANDS = {
    'run': [*CLI, 'run', '--duration', '1', '--record', 'new'],
    'composed': [*CLI, 'run', '--duration', '1', '--record', 'new', '--composed'],
    'replay': [*CLI, 'replay', 'flight.mcap'],
    'simulator': [sys.executable, '-m', 'rotor_sim.node'],
    'generator': [sys.executable, '-m', 'maneuver_gen.node'],
    'monitor': [sys.executable, '-m', 'vibration_monitor.node'],
    'recorder': [sys.executable, '-m', 'rotor_recording.recorder_node'],
    'viewer': [sys.executable, '-m', 'rotor_view.viewer_node'],
}


@pytest.mark.slow
@pytest.mark.parametrize('name', COMMANDS)
def test_every_command_of_dds_ends_in_one_sentence(tmp_path: Path, name: str) -> None:
    if name == 'replay':
        made = [*CLI, 'simulate', '--duration', '1', '--out', 'flight.mcap']
        subprocess.run(made, cwd=tmp_path, check=True, capture_output=True)
    ended = subprocess.run(
        COMMANDS[name],
        cwd=tmp_path,
        env={**private_environment(tmp_path / 'log'), 'ROS_SECURITY_ENABLE': 'true'},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=120.0,
        check=False,
    )
    assert ended.returncode == 2
    assert ended.stderr.startswith("error: ROS_SECURITY_STRATEGY = '' is not allowed with ROS_SEC")
    assert ended.stderr.count('\n') == 1
    assert not list(tmp_path.glob('new/*'))


def rights(enclave: str) -> dict[str, set[str]]:
    """Return what an enclave of the policy may do: names by right."""
    found: dict[str, set[str]] = {}
    (element,) = (
        each
        for each in ET.parse(POLICY).iter('enclave')  # noqa: S314 - our own file
        if each.get('path') == enclave
    )
    for names in element.iter('topics'):
        for right, qualifier in names.attrib.items():
            assert qualifier == 'ALLOW'
            found.setdefault(right, set()).update(str(topic.text) for topic in names)
    return found


def test_the_policy_has_every_topic_and_no_other() -> None:
    names = {each.name.lstrip('/') for each in TOPICS}
    of_ros = {'/rosout', '/parameter_events'}
    inside = {f'_run_*/{name}' for name in names}
    assert rights('/rotor_rig') == {
        'publish': names | inside | of_ros,
        'subscribe': names | inside | of_ros,
    }
    assert rights('/rotor_rig_listener') == {'publish': of_ros, 'subscribe': names | of_ros}


def test_the_policy_has_every_node() -> None:
    named = {
        str(call.args[0].value)
        for path in SOURCES.glob('*/*/**/*.py')
        if 'test' not in path.parts
        for call in ast.walk(ast.parse(path.read_text('utf-8')))
        if isinstance(call, ast.Call)
        and ast.unparse(call.func) == 'super().__init__'
        and len(call.args) == 1
        and isinstance(call.args[0], ast.Constant)
        and '(Node)' in path.read_text('utf-8')
    }
    assert {'rotor_sim', 'recorder', 'run_watcher', 'replay'} <= named
    profiles = ET.parse(POLICY).iter('profile')  # noqa: S314 - our own file
    assert {str(each.get('node')) for each in profiles} == named | {
        'rotor_rig_security_check',
        'listener',
    }


def test_a_hidden_topic_of_a_run_matches_the_policy() -> None:
    """The permissions of DDS match names as the shell does; * matches an ID."""
    import fnmatch

    from rotor_interfaces.run_topics import hidden_name, new_run_id

    patterns = rights('/rotor_rig')['publish']
    for each in TOPICS:
        name = hidden_name(each, new_run_id())
        assert any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)
        heard = rights('/rotor_rig_listener')['subscribe']
        assert not any(fnmatch.fnmatchcase(name, pattern) for pattern in heard)
