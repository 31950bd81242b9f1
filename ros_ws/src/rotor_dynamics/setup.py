# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# Written by scripts/package_files.py from ros_ws/packages.toml.
"""Nonlinear dynamics of the rotor: orbit diagrams, spectra, exponents, sections, maps."""

from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'rotor_dynamics'

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
        'distributed>=2025.1',
        'matplotlib>=3.9',
        'numpy>=2.1',
        'pyarrow>=17.0',
        'pydantic>=2.9',
        'rotor_common==0.1.0',
        'rotor_sim==0.1.0',
        'scipy>=1.14',
        'typer>=0.15',
        'xarray>=2024.9',
    ],
    entry_points={
        'rotor_rig.commands': [
            'lyapunov = rotor_dynamics.sweep_commands:LyapunovCommand',
            'map = rotor_dynamics.sweep_commands:MapCommand',
            'orbit-diagram = rotor_dynamics.sweep_commands:OrbitDiagramCommand',
            'poincare = rotor_dynamics.sweep_commands:PoincareCommand',
            'waterfall = rotor_dynamics.sweep_commands:WaterfallCommand',
        ],
    },
    zip_safe=False,
)
