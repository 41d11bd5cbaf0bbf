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
            'dot_tracker_node = tactile_perception.nodes.dot_tracker_node:main',
            'contact_region_node = tactile_perception.nodes.contact_region_node:main',
            'contact_point_node = tactile_perception.nodes.contact_point_node:main',
            'psd_contact_node = tactile_perception.nodes.psd_contact_node:main',
            'taxel_contact_node = tactile_perception.nodes.taxel_contact_node:main',
            'process_bag = tactile_perception.tools.process_bag:main',
            'evaluate = tactile_perception.tools.evaluate:main',
            'calibrate = tactile_perception.tools.calibrate.command:main',
            'convert_recording = tactile_perception.tools.convert.command:main',
        ],
    },
)
