# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# Written by scripts/package_files.py from ros_ws/packages.toml.
"""The rig in rerun: live views, recordings and screenshots."""

from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'rotor_view'

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
        'numpy>=2.1',
        'pillow>=11.0',
        'rerun-sdk>=0.41',
        'rotor_common==0.1.0',
        'rotor_interfaces==0.1.0',
        'rotor_recording==0.1.0',
        'typer>=0.15',
        'vibration_monitor==0.1.0',
    ],
    entry_points={
        'console_scripts': [
            'viewer_node = rotor_view.viewer_node:main',
        ],
        'rotor_rig.commands': [
            'view = rotor_view.view_command:view',
        ],
    },
    zip_safe=False,
)
