# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Flight profiles and the node that publishes their load."""

from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'maneuver_gen'

setup(
    name=PACKAGE,
    version='0.1.0',
    description='Flight profiles of the cracked rotor rig: load factor over time.',
    author='The cracked rotor rig authors',
    license='Apache-2.0',
    python_requires='>=3.11,<3.14',
    package_dir={'': '.'},
    packages=find_packages(include=[PACKAGE, f'{PACKAGE}.*']),
    package_data={PACKAGE: ['py.typed', 'flights/*.csv']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        (f'share/{PACKAGE}/launch', glob('launch/*.launch.py')),
        (f'share/{PACKAGE}/config', glob('config/*.yaml')),
    ],
    install_requires=[
        'numpy>=2.0',
        'pydantic>=2.9',
        'rotor_interfaces==0.1.0',
    ],
    entry_points={
        'console_scripts': [
            'maneuver_gen_node = maneuver_gen.node:main',
        ],
    },
    zip_safe=False,
)
