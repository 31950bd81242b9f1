# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# Written by scripts/package_files.py from ros_ws/packages.toml.
"""The rig as a Python library: scenarios, the offline run, recordings analyzed."""

from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'rotor_rig'

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
        'maneuver_gen==0.1.0',
        'matplotlib>=3.9',
        'numpy>=2.1',
        'pydantic>=2.9',
        'rich>=13.9',
        'rotor_common==0.1.0',
        'rotor_dynamics==0.1.0',
        'rotor_interfaces==0.1.0',
        'rotor_recording==0.1.0',
        'rotor_sim==0.1.0',
        'typer>=0.15',
        'vibration_monitor==0.1.0',
        'xarray>=2024.9',
    ],
    entry_points={
        'rotor_rig.commands': [
            'plant = rotor_rig.plant_commands:app',
            'scenario = rotor_rig.scenario_commands:app',
        ],
    },
    zip_safe=False,
)
