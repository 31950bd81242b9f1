# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# Written by scripts/package_files.py from ros_ws/packages.toml.
"""The cracked rotor on ball bearings as a source of measurements: model, integrator, sensors."""

from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'rotor_sim'

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
        'numba>=0.61',
        'numpy>=2.1',
        'pydantic>=2.9',
        'rotor_common==0.1.0',
        'rotor_interfaces==0.1.0',
        'scipy>=1.14',
    ],
    entry_points={
        'console_scripts': [
            'rotor_sim_node = rotor_sim.node:main',
        ],
    },
    zip_safe=False,
)
