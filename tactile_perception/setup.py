# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Build rules of tactile_perception, run by colcon."""

from setuptools import find_packages, setup

PACKAGE = 'tactile_perception'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test', 'test.*']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + PACKAGE]),
        ('share/' + PACKAGE, ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=False,
    maintainer='The tactile authors',
    maintainer_email='tactile@users.noreply.github.com',
    description='What a tactile sensor feels: dots, contact regions, contacts, slip, wrench.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'dot_tracker_node = tactile_perception.nodes.start:dot_tracker_node',
            'contact_region_node = tactile_perception.nodes.start:contact_region_node',
            'contact_point_node = tactile_perception.nodes.start:contact_point_node',
            'psd_contact_node = tactile_perception.nodes.start:psd_contact_node',
            'taxel_contact_node = tactile_perception.nodes.start:taxel_contact_node',
            'process_bag = tactile_perception.nodes.start:process_bag',
            'evaluate = tactile_perception.nodes.start:evaluate',
            'calibrate = tactile_perception.nodes.start:calibrate',
            'convert_recording = tactile_perception.nodes.start:convert_recording',
        ],
    },
)
