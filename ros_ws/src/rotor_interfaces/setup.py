# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The wire contract of the rig; the extra `ros` brings ROS 2 Jazzy where /opt/ros is missing."""

from setuptools import find_packages, setup

PACKAGE = 'rotor_interfaces'

setup(
    name=PACKAGE,
    version='0.1.0',
    description='The wire contract of the cracked rotor rig: topics, QoS, waveform codec.',
    author='The cracked rotor rig authors',
    license='Apache-2.0',
    python_requires='>=3.11,<3.14',
    package_dir={'': '.'},
    packages=find_packages(include=[PACKAGE, f'{PACKAGE}.*']),
    package_data={PACKAGE: ['py.typed', '*.xml']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
    ],
    install_requires=[
        'numpy>=2.0',
        'pydantic>=2.9',
        'pyyaml>=6.0',
        'rosbags>=0.11',
    ],
    extras_require={
        'ros': [
            'ros-jazzy-common-interfaces==5.3.6',
            'ros-jazzy-rclpy[fastrtps]==7.1.6',
        ],
    },
    zip_safe=False,
)
