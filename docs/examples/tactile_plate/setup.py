# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Build rules of tactile_plate. The entry points are all that the tactile packages need to know of it."""
from glob import glob

from setuptools import setup

setup(
    name='tactile_plate',
    version='0.1.0',
    packages=['tactile_plate'],
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/tactile_plate']),
        ('share/tactile_plate', ['package.xml']),
        ('share/tactile_plate/launch', glob('launch/*.launch.py')),
        ('share/tactile_plate/params', glob('params/*.yaml')),
        ('share/tactile_plate/rviz', glob('rviz/*.rviz')),
    ],
    entry_points={
        'tactile_perception.sensor_types': ['plate = tactile_plate.sensor_type:PLATE'],
        'tactile_perception.nodes': ['plate_node = tactile_plate.stage:PlateStage'],
        'tactile_driver.taxel_scenes': ['plate_demo = tactile_plate.simulation:PlateScene'],
        'console_scripts': ['plate_node = tactile_perception.core.node:main'],
    },
)
