# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# Written by scripts/package_files.py from ros_ws/packages.toml.
"""Recordings in MCAP: writing, reading, recovery, replay, and import of foreign files."""

from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'rotor_recording'

setup(
    name=PACKAGE,
    version='0.1.0',
    description=__doc__,
    author='The cracked rotor rig authors',
    license='Apache-2.0',
    python_requires='>=3.11,<3.14',
    package_dir={'': '.'},
    packages=find_packages(include=[PACKAGE, f'{PACKAGE}.*']),
    package_data={PACKAGE: ['py.typed', '**/*.csv', '**/*.xml', '**/*.yaml']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        *(
            (f'share/{PACKAGE}/{folder}', files)
            for folder in ('config', 'launch', 'security')
            if (files := glob(f'{folder}/*.*'))
        ),
    ],
    install_requires=[
        'lz4>=4.3',
        'mcap>=1.5',
        'numpy>=2.1',
        'pydantic>=2.9',
        'pyyaml>=6.0',
        'rich>=13.9',
        'rosbags>=0.11',
        'rotor_common==0.1.0',
        'rotor_interfaces==0.1.0',
        'scipy>=1.14',
        'typer>=0.15',
        'zstandard>=0.23',
    ],
    entry_points={
        'console_scripts': [
            'recorder_node = rotor_recording.recorder_node:main',
        ],
        'rotor_rig.commands': [
            'import = rotor_recording.import_command:import_recording',
            'recover = rotor_recording.recording_commands:recover',
            'replay = rotor_recording.recording_commands:replay',
            'verify = rotor_recording.recording_commands:verify',
        ],
    },
    zip_safe=False,
)
