# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Build rules of tactile_bringup, run by colcon."""

from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'tactile_bringup'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test', 'test.*']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + PACKAGE]),
        ('share/' + PACKAGE, ['package.xml']),
        ('share/' + PACKAGE + '/launch', sorted(glob('launch/*.launch.py'))),
        ('share/' + PACKAGE + '/params', sorted(glob('params/*.yaml'))),
        ('share/' + PACKAGE + '/calibration', sorted(glob('calibration/*.yaml'))),
        ('share/' + PACKAGE + '/hands', sorted(glob('hands/*.yaml'))),
        ('share/' + PACKAGE + '/rviz', sorted(glob('rviz/*.rviz'))),
        ('share/' + PACKAGE + '/sros', sorted(glob('sros/*.policy.xml'))),
    ],
    install_requires=['setuptools'],
    zip_safe=False,
    maintainer='The tactile authors',
    maintainer_email='tactile@users.noreply.github.com',
    description='Launch files and parameters of the tactile sensors, RViz configurations, markers, the demo.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'markers_node = tactile_bringup.nodes.start:markers_node',
            'finger_markers_node = tactile_bringup.nodes.start:finger_markers_node',
            'taxel_markers_node = tactile_bringup.nodes.start:taxel_markers_node',
            'record_node = tactile_bringup.nodes.start:record_node',
            'hand_frames_node = tactile_bringup.nodes.start:hand_frames_node',
            'hand_node = tactile_bringup.nodes.start:hand_node',
            'hand_config = tactile_bringup.nodes.start:hand_config',
            'status = tactile_bringup.nodes.start:status',
            'snapshot = tactile_bringup.nodes.start:snapshot',
            'simulate = tactile_bringup.simulate:main',
            'demo = tactile_bringup.nodes.start:demo',
            'grip_reflex = tactile_bringup.nodes.grip_reflex:main',
            'simulated_gripper = tactile_bringup.nodes.simulated_gripper:main',
        ],
    },
)
