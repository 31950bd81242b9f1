# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Who can reach a run over the network: nobody, unless its range opens it."""

import ipaddress
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from xml.etree import ElementTree as ET

import psutil  # type: ignore[import-untyped]
import pytest
import yaml
from live_flight import CLI, private_environment

from rotor_interfaces import access
from rotor_view import viewer

RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
PROFILE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
NAMES = (RANGE, PROFILE, 'ROS_LOCALHOST_ONLY', 'RMW_IMPLEMENTATION')
LOOPBACK = str(access.LOOPBACK_PROFILE)
NETWORK = str(access.NETWORK_PROFILE)


def environment_of(monkeypatch: pytest.MonkeyPatch, **given: str) -> tuple[str, str | None]:
    """Return the range and the profile that come out of what is given."""
    for name in NAMES:
        monkeypatch.delenv(name, raising=False)
    for name, value in given.items():
        monkeypatch.setenv(name, value)
    for _ in range(2):  # also in a process that one of the rig has started
        access.keep_on_this_machine()
    return os.environ[RANGE], os.environ.get(PROFILE)


@pytest.mark.parametrize(
    ('given', 'expected'),
    [
        ({}, ('SYSTEM_DEFAULT', LOOPBACK)),
        ({RANGE: ''}, ('SYSTEM_DEFAULT', LOOPBACK)),
        ({RANGE: 'LOCALHOST'}, ('SYSTEM_DEFAULT', LOOPBACK)),
        ({RANGE: 'LOCALHOST', PROFILE: NETWORK}, ('SYSTEM_DEFAULT', LOOPBACK)),
        ({RANGE: 'SUBNET', 'ROS_LOCALHOST_ONLY': '1'}, ('SYSTEM_DEFAULT', LOOPBACK)),
        ({'RMW_IMPLEMENTATION': 'rmw_fastrtps_cpp'}, ('SYSTEM_DEFAULT', LOOPBACK)),
        ({RANGE: 'OFF'}, ('OFF', LOOPBACK)),
        ({RANGE: 'SUBNET'}, ('SUBNET', NETWORK)),
        ({RANGE: 'SUBNET', PROFILE: LOOPBACK}, ('SUBNET', NETWORK)),
        ({RANGE: 'SYSTEM_DEFAULT'}, ('SYSTEM_DEFAULT', NETWORK)),
        ({PROFILE: ''}, ('LOCALHOST', '')),
        ({PROFILE: 'mine.xml', RANGE: 'SUBNET'}, ('SUBNET', 'mine.xml')),
        ({'RMW_IMPLEMENTATION': 'rmw_cyclonedds_cpp'}, ('LOCALHOST', None)),
    ],
)
def test_only_a_range_opens_the_network(
    monkeypatch: pytest.MonkeyPatch, given: dict[str, str], expected: tuple[str, str | None]
) -> None:
    assert environment_of(monkeypatch, **given) == expected


def test_the_profiles_differ_only_in_where_they_reach() -> None:
    """The times of a run are the same on this machine and in a network."""
    spaces = {'': 'http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles'}
    local, network = (ET.parse(path).getroot() for path in (LOOPBACK, NETWORK))  # noqa: S314 - ours
    for parent, child in (
        ('.', 'transport_descriptors'),
        ('participant/rtps', 'userTransports'),
        ('participant/rtps', 'useBuiltinTransports'),
        ('participant/rtps/builtin', 'metatrafficUnicastLocatorList'),
        ('participant/rtps/builtin', 'initialPeersList'),
    ):
        owner = local.find(parent, spaces)
        assert owner is not None
        found = owner.find(child, spaces)
        assert found is not None
        owner.remove(found)
    assert ET.canonicalize(ET.tostring(local), strip_text=True) == ET.canonicalize(
        ET.tostring(network), strip_text=True
    )


def open_addresses(process: psutil.Process) -> dict[int, set[str]]:
    """Return, for a process and all below it, the addresses of its UDP and listening sockets."""
    found: dict[int, set[str]] = {}
    for each in (process, *process.children(recursive=True)):
        try:
            links = each.net_connections('inet')
        except psutil.Error:  # has just ended
            continue
        found[each.pid] = {
            link.laddr.ip
            for link in links
            if link.laddr and link.status in (psutil.CONN_LISTEN, psutil.CONN_NONE)
        }
    return found


def is_loopback(address: str) -> bool:
    return ipaddress.ip_address(address).is_loopback


def watched(command: list[str], environment: dict[str, str]) -> dict[int, set[str]]:
    """Run a command to its good end; return the open addresses of all its processes."""
    environment.pop(PROFILE, None)
    seen: dict[int, set[str]] = {}
    with subprocess.Popen(
        command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL
    ) as started:
        while started.poll() is None:
            for pid, addresses in open_addresses(psutil.Process(started.pid)).items():
                seen.setdefault(pid, set()).update(addresses)
            time.sleep(0.1)
    assert started.returncode == 0
    assert all(map(is_loopback, set.union(*seen.values()))), seen
    return {pid: addresses for pid, addresses in seen.items() if addresses}


@pytest.mark.slow
@pytest.mark.parametrize('options', [[], ['--composed']])
def test_every_socket_of_a_run_is_of_the_loopback_interface(
    tmp_path: Path, options: list[str]
) -> None:
    command = [*CLI, 'run', '--duration', '3', '--record', str(tmp_path / 'new'), *options]
    talking = watched(command, private_environment(tmp_path / 'log'))
    assert len(talking) == (2 if options else 5)  # the command itself watches


@pytest.mark.slow
@pytest.mark.skipif(shutil.which('Xvfb') is None, reason='needs Xvfb')
def test_the_window_of_a_run_listens_on_the_loopback_interface(tmp_path: Path) -> None:
    environment = private_environment(tmp_path / 'log')
    command = [*CLI, 'run', '--duration', '3', '--record', str(tmp_path / 'new'), '--view']
    with subprocess.Popen(
        ['Xvfb', '-displayfd', '1', '-screen', '0', '800x500x24', '-nolisten', 'tcp'],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as screen:
        assert screen.stdout is not None
        environment['DISPLAY'] = f':{screen.stdout.readline().strip()}'
        talking = watched(command, environment)
        # the viewer's node and its window, which stays open
        windows = [pid for pid in talking if psutil.pid_exists(pid)]
        try:
            assert len(talking) == 7
            assert len(windows) == 1
            assert talking[windows[0]] == {'127.0.0.1'}
        finally:
            for pid in windows:
                psutil.Process(pid).kill()
            screen.terminate()


@pytest.mark.slow
def test_the_viewer_of_a_picture_listens_on_the_loopback_interface(tmp_path: Path) -> None:
    if not list(viewer.LAVAPIPE.glob('lvp_icd*.json')):
        pytest.skip('needs the software renderer of Mesa; scripts/install_viewer_packages')
    made = [*CLI, 'simulate', '--duration', '1', '--out', str(tmp_path / 'a.mcap')]
    subprocess.run(made, check=True, capture_output=True)
    command = [*CLI, 'view', str(tmp_path / 'a.mcap'), '--screenshot', str(tmp_path / 'a.png')]
    (addresses,) = watched(command, dict(os.environ)).values()
    assert addresses == {'127.0.0.1'}


@pytest.mark.slow
def test_the_helpers_of_an_evaluation_listen_nowhere_else(tmp_path: Path) -> None:
    """Isolated detectors have no sockets at all; a node under test keeps to this machine too."""
    group = {'name': 'test', 'split': 'test', 'machines': 1, 'healthy': 1, 'cracked': 0,
             'growing': 0, 'held_out': True, 'noise': ['realistic']}  # fmt: skip
    suite = tmp_path / 'small.yaml'
    references = [{'family': 'pulls_3g', 'speed_program': 'steady'}]
    suite.write_text(
        yaml.safe_dump(
            {
                'base': 'smoke',
                'name': 'small',
                'flight_s': 10.0,
                'groups': [group],
                'references': references,
            }
        )
    )
    node = f'{sys.executable} {Path(__file__).parent / "score_node.py"}'
    environment = private_environment(tmp_path / 'log')
    environment.pop(RANGE)  # to the node, it would be ROS's own: the whole subnet
    talking = watched(
        [*CLI, 'evaluate', 'zones', 'topic:my/score', '--node-command', node, '--suite',
         str(suite), '--out', str(tmp_path / 'out'), '--jobs', '1'],
        environment,
    )  # fmt: skip
    assert len(talking) == 2  # the node and the replay


TALK = """
import time
import numpy as np
import rclpy
from rotor_interfaces import access, ros, topics
from rotor_interfaces.messages import ROS
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock, encode

access.keep_on_this_machine()
rclpy.init()
output = ros.publisher(rclpy.create_node('talker'), topics.WAVEFORM)
print('ready', flush=True)
while True:
    output.publish(encode(WaveformBlock(0, np.zeros(256, WAVEFORM_DTYPE)), ROS))
    time.sleep(0.025)
"""
LISTEN = """
import time
import rclpy
from rotor_interfaces import ros, topics

rclpy.init()
node = rclpy.create_node('listener')
blocks = []
ros.subscription(node, topics.WAVEFORM, blocks.append)
end = time.monotonic() + 6.0
while time.monotonic() < end:
    rclpy.spin_once(node, timeout_sec=0.1)
print(len(blocks))
"""
OUTSIDE = """
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <transport_descriptors><transport_descriptor>
    <transport_id>outside</transport_id><type>UDPv4</type>
    <interfaceWhiteList><address>10.9.0.1</address></interfaceWhiteList>
  </transport_descriptor></transport_descriptors>
  <participant profile_name="outside" is_default_profile="true"><rtps>
    <userTransports><transport_id>outside</transport_id></userTransports>
    <useBuiltinTransports>false</useBuiltinTransports>
    <builtin><initialPeersList>
      <locator><udpv4><address>10.9.0.1</address></udpv4></locator>
      <locator><udpv4><address>127.0.0.1</address></udpv4></locator>
      <locator><udpv4><address>239.255.0.1</address><port>7400</port></udpv4></locator>
    </initialPeersList></builtin>
  </rtps></participant>
</profiles>
"""
"""A participant that has another address of the machine alone, as one of another machine has."""
NETWORK_OF_ITS_OWN = """
set -e
ip link set lo up
ip link add outside type veth peer name other
ip addr add 10.9.0.1/24 dev outside
ip link set outside up
ip link set other up
ip route add 224.0.0.0/4 dev outside
"$1" -c "$TALK" > >(grep -m 1 ready) &
talker=$!
sleep 3
export ROS_AUTOMATIC_DISCOVERY_RANGE=SYSTEM_DEFAULT FASTRTPS_DEFAULT_PROFILES_FILE=$OUTSIDE
"$1" -c "$LISTEN"
kill $talker
"""


def can_make_a_network() -> bool:
    if not shutil.which('unshare') or not shutil.which('ip'):
        return False
    command = 'ip link add outside type veth peer name other'
    made = subprocess.run(
        ['unshare', '-rn', 'bash', '-c', command], capture_output=True, check=False
    )
    return made.returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize(('wanted', 'is_heard'), [('LOCALHOST', False), ('SUBNET', True)])
def test_another_address_hears_a_node_only_in_a_network(
    tmp_path: Path, wanted: str, is_heard: bool
) -> None:
    if not can_make_a_network():
        pytest.skip('needs a network namespace: unshare -rn, ip, veth')
    outside = tmp_path / 'outside.xml'
    outside.write_text(OUTSIDE)
    environment = private_environment(tmp_path / 'log')
    environment.pop(PROFILE, None)
    environment |= {RANGE: wanted, 'TALK': TALK, 'LISTEN': LISTEN, 'OUTSIDE': str(outside)}
    environment['ROS_DOMAIN_ID'] = '0'  # that of the port above
    ended = subprocess.run(
        ['unshare', '-rn', 'bash', '-c', NETWORK_OF_ITS_OWN, 'bash', sys.executable],
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=300.0,
        check=True,
    )
    heard = int(ended.stdout.split()[-1])
    assert 'ready' in ended.stdout
    assert heard > 50 if is_heard else heard == 0
