# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Simulated sheets and cushion with the calibrations that ship, and their processing stages."""
import numpy as np
import pytest
from tactile_bringup.installed import share
from tactile_driver.simulation.sensors import scenes
from tactile_driver.stitching.calibration import stitching_from_dict
from tactile_driver.stitching.methods import make_stitcher
from tactile_perception.calibration.files.markers import read_touch
from tactile_perception.markers.view.camera_views import view_maker
from tactile_perception.parameters.file import read_parameters
from tactile_perception.parameters.markers import POINT_PARAMETERS, marker_sensor
from tactile_perception.parameters.touchpad import DOT_PARAMETERS
from tactile_perception.dots.tracker import make_tracker
from tactile_perception.pipeline.marker_stage import TouchEstimator
from tactile_perception.touchpad.sensor import Touchpad, camera_pose

RATE = 10.0
SENSORS = ('areal_single', 'areal_dual', 'air_cushion')
PRESSED_AT = {'areal_single': 2.9, 'areal_dual': 2.9, 'air_cushion': 3.2}  # s from the start of the scenes with one press


class Sheet:
    """A simulated sensor, calibrated as it ships. rest: untouched images; pressed: (image, truth) at each depth where the tip stops."""

    def __init__(self, kind, name, at, scene=None):
        two = kind == 'areal_dual'
        self.kind, self.calibration = kind, read_touch(share('calibration', f'{kind}_sim.yaml'), kind)
        self.scene = scene or (scenes.open_dual_scene if two else scenes.open_scene)(name, rate=RATE)
        stitching = stitching_from_dict(self.calibration.stitching, kind) if two else None
        self._stitcher = make_stitcher('plane', stitching) if two else None
        params = share('params', f'{kind}_sim.yaml')
        self.dot_values = read_parameters(params, 'dot_tracker_node', DOT_PARAMETERS)
        self.values = read_parameters(params, 'contact_point_node', POINT_PARAMETERS)
        self.sensor, camera = marker_sensor(self.values), self.scene.camera
        self.make_view = view_maker(self.sensor, (camera.matrix, camera.distortion), self.calibration.stitching, camera_pose(self.values))
        self.rest = [self.image(k / RATE)[0] for k in range(6)]
        self.pressed, self.truth = self.image(at)

    def image(self, t):
        """(image, contacts) at t s."""
        if self._stitcher is None:
            seen = self.scene.render(t)
            return seen.image, seen.truth.contacts
        left, right, truth = self.scene.render(t)
        return self._stitcher.stitch(left, right), truth.contacts

    def chain(self, rest=None):
        return Chain(self, self.rest if rest is None else rest)


class Chain:
    """Tracker and touch stage; each call is a tenth of a second later, unless a stamp is given."""

    def __init__(self, sheet, rest):
        self.sheet, self.stamp = sheet, 1.0
        self.tracker = make_tracker(Touchpad.from_parameters(sheet.dot_values), sheet.dot_values, rest=sheet.calibration.rest)
        self.stage = TouchEstimator(sheet.sensor, sheet.make_view, sheet.values, sheet.calibration)
        for image in rest:
            self(image)

    def __call__(self, image, keep=None, stamp=None):
        tracks = self.tracker.process(image, self._next(stamp))
        return self.touch(tracks if keep is None else tracks.take(keep(tracks)), self.stamp)

    def _next(self, stamp=None):
        self.stamp = self.stamp + 1 / RATE if stamp is None else stamp
        return self.stamp

    def touch(self, tracks, stamp=None):
        result = self.stage.process(tracks, self._next() if stamp is None else stamp)
        for contact in result.contacts:
            assert np.isfinite(contact.position).all() and np.isfinite(contact.depth) and contact.depth >= 0
            assert np.linalg.eigvalsh(contact.position_covariance).min() >= 0
        return result


def nothing(result):
    return not result.contacts and result.region.area == 0 and np.isnan(result.wrench).all()


def check_right(result, truth, place, depth):
    assert len(result.contacts) == len(truth) == 1
    assert np.hypot(*(result.contacts[0].position - truth[0].position)[:2]) < place
    assert result.contacts[0].depth == pytest.approx(truth[0].depth, abs=depth)
