# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Scenarios, launch files and the command line that puts the rig together."""

from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'rotor_bringup'

setup(
    name=PACKAGE,
    version='0.1.0',
    description='The cracked rotor rig put together: scenarios, launch files, rotor-rig.',
    author='The cracked rotor rig authors',
    license='Apache-2.0',
    python_requires='>=3.11,<3.14',
    package_dir={'': '.'},
    packages=find_packages(include=[PACKAGE, f'{PACKAGE}.*']),
    package_data={
        PACKAGE: ['py.typed', 'paper/*.yaml', 'scenarios/*.yaml', 'dataset/suites/*.yaml']
    },
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        (f'share/{PACKAGE}/launch', glob('launch/*.launch.py')),
        (f'share/{PACKAGE}/security', ['security/policy.xml']),
    ],
    install_requires=[
        'distributed>=2025.1',
        'maneuver_gen==0.1.0',
        'matplotlib>=3.9',
        'numpy>=2.1',
        'pillow>=11.0',
        'pyarrow>=17.0',
        'pydantic>=2.9',
        'pyyaml>=6.0',
        'rich>=13.9',
        'rotor_interfaces==0.1.0',
        'rotor_sim==0.1.0',
        'scipy>=1.14',
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
            'setuptools>=77,<80',  # builds the packages; colcon wants it below 80
            'types-PyYAML>=6.0',
            'uv>=0.9',  # scripts/env installs with it
        ],
    },
    entry_points={
        'console_scripts': [
            'rotor-rig = rotor_bringup.__main__:main',
        ],
    },
    zip_safe=False,
)
