# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact and slip of a touchpad, frame by frame; the frames are of the simulated one."""
import numpy as np

from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception import Touchpad, TouchpadContact, node_parameters, touchpad_tracker

PARAMETERS = 'tactile_bringup/params/touchpad_sim.yaml'
RATE = 15.0  # frames/s
scene = open_scene('rectangle_drag', RATE)

values = node_parameters('touchpad_contact_node', PARAMETERS)
sensor = Touchpad.from_parameters(values)
camera = sensor.camera(scene.camera.matrix, scene.camera.distortion)
dots = touchpad_tracker(sensor, camera, values)
contact = TouchpadContact(sensor, camera, values)

for k in range(90):
    stamp_s = k / RATE
    tracks = dots.process(scene.render(stamp_s).image, stamp_s)
    result = contact.process(tracks, stamp_s)
    force, displacement = result.wrench[:3], np.nanmax(np.hypot(*tracks.duv.T))
    if k % 12 == 0:
        print(f'{stamp_s:.2f} s: {len(tracks)} dots, largest displacement {displacement:.1f} px, area {1e6 * result.region.area:.0f} mm2, '
              f'force {force.round(2)} N, slip {("none", "incipient", "gross")[result.slip.state]}')
