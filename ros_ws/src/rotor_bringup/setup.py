# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# Written by scripts/package_files.py from ros_ws/packages.toml.
"""The rig put together: launch files, live supervision and the command rotor-rig."""

from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'rotor_bringup'

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
        'numpy>=2.1',
        'pyyaml>=6.0',
        'rich>=13.9',
        'rotor_common==0.1.0',
        'rotor_interfaces==0.1.0',
        'rotor_recording==0.1.0',
        'rotor_rig==0.1.0',
        'rotor_sim==0.1.0',
        'rotor_view==0.1.0',
        'typer>=0.15',
        'vibration_monitor==0.1.0',
    ],
    extras_require={
        'test': [
            'colcon-bash>=0.5',
            'colcon-ros>=0.5',
            'hypothesis>=6.100',
            'mcap-ros2-support>=0.5',
            'mypy>=1.13',
            'packaging>=24.0',
            'psutil>=6.0',
            'pytest>=8.3',
            'pytest-timeout>=2.3',
            'pytest-xdist>=3.6',
            'ruff>=0.9',
            'setuptools>=77,<80',
            'types-PyYAML>=6.0',
            'uv>=0.9',
        ],
    },
    entry_points={
        'console_scripts': [
            'rotor-rig = rotor_bringup.__main__:main',
        ],
        'rotor_rig.commands': [
            'analyze = rotor_bringup.analyze_command:analyze',
            'baseline = rotor_bringup.baseline_command:baseline',
            'run = rotor_bringup.run_command:run',
            'simulate = rotor_bringup.simulate_command:simulate',
        ],
    },
    zip_safe=False,
)
