# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Orders, indicators and alarm; recorder, replay and viewer."""

from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'vibration_monitor'

setup(
    name=PACKAGE,
    version='0.1.0',
    description='The monitor of the cracked rotor rig: indicators, alarm, recordings, views.',
    author='The cracked rotor rig authors',
    license='Apache-2.0',
    python_requires='>=3.11,<3.14',
    package_dir={'': '.'},
    packages=find_packages(include=[PACKAGE, f'{PACKAGE}.*']),
    package_data={PACKAGE: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        (f'share/{PACKAGE}/launch', glob('launch/*.launch.py')),
        (f'share/{PACKAGE}/config', glob('config/*.yaml')),
    ],
    install_requires=[
        'lz4>=4.3',
        'mcap>=1.5',
        'numba>=0.61',
        'numpy>=2.0',
        'pillow>=11.0',
        'pydantic>=2.9',
        'pyyaml>=6.0',
        'rerun-sdk>=0.41',
        'rosbags>=0.11',
        'rotor_interfaces==0.1.0',
        'scipy>=1.14',
        'zstandard>=0.23',
    ],
    entry_points={
        'console_scripts': [
            'recorder_node = vibration_monitor.recorder_node:main',
            'vibration_monitor_node = vibration_monitor.node:main',
            'viewer_node = vibration_monitor.viewer_node:main',
        ],
        'rotor_rig.detectors': [
            'baseline = vibration_monitor.detectors.baseline:BaselineDetector',
            'ratios = vibration_monitor.detectors.ratios:RatioDetector',
            'zones = vibration_monitor.detectors.zones:ZoneDetector',
        ],
    },
    zip_safe=False,
)
