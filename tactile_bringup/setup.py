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
        ('share/' + PACKAGE + '/calibration', sorted(glob('calibration/*.yaml') + glob('calibration/*.npz'))),
        ('share/' + PACKAGE + '/hands', sorted(glob('hands/*.yaml'))),
        ('share/' + PACKAGE + '/rviz', sorted(glob('rviz/*.rviz'))),
        ('share/' + PACKAGE + '/layouts', sorted(glob('layouts/*'))),
        ('share/' + PACKAGE + '/urdf', sorted(glob('urdf/*.xacro'))),
        ('share/' + PACKAGE + '/sros', sorted(glob('sros/*.policy.xml'))),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest', 'pytest-timeout']},
    zip_safe=False,
    maintainer='The tactile authors',
    maintainer_email='maintainer@example.com',
    description='Launch files and parameters of the tactile sensors, RViz configurations, markers, the demo.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'markers_node = tactile_perception.core.node:main',
            'finger_markers_node = tactile_perception.core.node:main',
            'taxel_markers_node = tactile_perception.core.node:main',
            'surface_markers_node = tactile_perception.core.node:main',
            'force_markers_node = tactile_perception.core.node:main',
            'record_node = tactile_bringup.nodes.record_node:main',
            'calibrate_node = tactile_bringup.nodes.calibrate_node:main',
            'simulated_stage = tactile_bringup.nodes.simulated_stage:main',
            'hand_node = tactile_bringup.nodes.hand_node:main',
            'sensor_nodes = tactile_bringup.nodes.compose:main',
            'hand_config = tactile_bringup.hand.configurations:main',
            'status = tactile_bringup.nodes.status:main',
            'simulate = tactile_bringup.simulate.bags:main',
            'view = tactile_bringup.view.command:main',
            'export = tactile_bringup.export.command:main',
            'papers = tactile_bringup.papers.command:main',
            'demo = tactile_bringup.demo:main',
            'gripper_node = tactile_bringup.grasp.gripper_node:main',
            'gripper_follower = tactile_bringup.grasp.follower_node:main',
            'grip_controller = tactile_bringup.grasp.grip_controller_node:main',
            'grasp_poses = tactile_bringup.grasp.pose_experiment:main',
            'grasp_postures = tactile_bringup.grasp.postures:main',
            'grasp_video = tactile_bringup.grasp.video:main',
            'grasp_table = tactile_bringup.grasp.experiment:main',
        ],
        'tactile_perception.nodes': [
            'markers_node = tactile_bringup.nodes.drawing_node:MarkersNode',
            'finger_markers_node = tactile_bringup.nodes.drawing_node:FingerMarkersNode',
            'taxel_markers_node = tactile_bringup.nodes.drawing_node:TaxelMarkersNode',
            'surface_markers_node = tactile_bringup.nodes.drawing_node:SurfaceMarkersNode',
            'force_markers_node = tactile_bringup.nodes.drawing_node:ForceMarkersNode',
        ],
    },
)
