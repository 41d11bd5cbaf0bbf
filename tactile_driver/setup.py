# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Build rules of tactile_driver, run by colcon."""

from setuptools import find_packages, setup

PACKAGE = 'tactile_driver'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test', 'test.*']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + PACKAGE]),
        ('share/' + PACKAGE, ['package.xml']),
        ('share/' + PACKAGE + '/udev', ['udev/70-tactile-sensors.rules']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest', 'pytest-timeout']},
    package_data={PACKAGE: ['nodes/runtime/*.xml']},
    zip_safe=False,
    maintainer='The tactile authors',
    maintainer_email='maintainer@example.com',
    description='Drivers of tactile sensors: one node for a device, a recording or a simulated sensor.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'camera_node = tactile_driver.nodes.camera_node:main',
            'dual_camera_node = tactile_driver.nodes.dual_camera_node:main',
            'psd_node = tactile_driver.nodes.psd_node:main',
            'psd_emulator = tactile_driver.emulators:psd_emulator',
            'taxel_array_node = tactile_driver.nodes.taxel_array_node:main',
            'taxel_emulator = tactile_driver.emulators:taxel_emulator',
            'force_taxel_node = tactile_driver.force_taxels.node:main',
            'force_taxel_emulator = tactile_driver.force_taxels.emulator:force_taxel_emulator',
        ],
    },
)
