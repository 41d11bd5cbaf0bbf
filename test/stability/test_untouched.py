# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Untouched sensors report no contact: whole images with noise, and dot positions with the noise measured in images."""
from dataclasses import replace

import numpy as np
import pytest
from pad_rig import Pad
from tactile_driver.simulation.optics.water_light import Lighting
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_driver.simulation.sensors.touchpad import touchpad
from tactile_perception.common.dots import DotTracks
from tactile_perception.pipeline.contact_stage import ContactEstimator
from tactile_perception.dots.tracker import make_tracker
from tactile_perception.touchpad.membrane.solver import Membrane
from tactile_perception.touchpad.optics.identification import fit_rest
from tactile_perception.touchpad.places import DotPlaces
from tactile_perception.touchpad.sensor import Touchpad


def grains(count):
    """Noise fields (count, 480, 640, 3) of which any two make a new one; grey levels, standard deviation 1."""
    return np.random.default_rng(5).standard_normal((count, 480, 640, 3), np.float32)


def noisy_frames(pad, count, level):
    """Untouched frames with noise of so many grey levels beyond the camera's own."""
    rng, fields = np.random.default_rng(6), grains(6)
    for _ in range(count):
        one, other = rng.choice(len(fields), 2, replace=False)
        shift = tuple(rng.integers(0, 400, 2))
        noise = (fields[one] + np.roll(fields[other], shift, (0, 1))) * np.float32(level / np.sqrt(2))
        yield np.clip(np.rint(pad.rest[rng.integers(0, 6)] + noise), 0, 255).astype(np.uint8)


def untouched(result):
    return not result.contacts and result.region.area == 0 and not (result.region.dot_state > 0).any() and not np.abs(result.wrench).any()


def false_images(pad, count, level):
    """Of `count` images with that noise, those in which anything is found."""
    chain = pad.chain()
    return sum(not untouched(chain(image)[1]) for image in noisy_frames(pad, count, level))


@pytest.mark.parametrize('level', [1, 4])
def test_no_contact_in_noisy_images(pad, level):
    assert false_images(pad, 80, level) == 0


def false_with_glare(count, seed, lighting=None):
    """Of `count` untouched frames of another specimen with glare, lamps in the window and a drifting gain, those with anything found;
    lighting: another than the scene's."""
    scene = open_scene('glare_rest', rate=30.0, seed=seed)
    if lighting is not None:
        scene._renderer = touchpad(seed, 640, lighting, replace(scene._renderer.imaging, drift_period=40)).renderers[0]
    values = Pad().values()
    sensor = Touchpad.from_parameters(values)
    camera = sensor.camera(scene.camera.matrix, scene.camera.distortion)
    tracker, places, contact = make_tracker(sensor, values), DotPlaces(sensor, camera), ContactEstimator(sensor, camera, values)
    false = 0
    for k in range(count):
        image = scene.render(k / 30).image
        tracks = tracker.process(image, 1 + k / 30)
        tracks.xyz = places.locate(image, tracks)
        false += not untouched(contact.process(tracks, 1 + k / 30))
    return false


def test_no_contact_with_glare_and_drift():
    assert false_with_glare(100, 11) == 0


@pytest.mark.parametrize('seed, sheen', [(1, 0.16), (2, 0.19), (3, 0.2)])
def test_no_contact_with_white_highlights_and_drift(seed, sheen):
    lighting = Lighting(gloss=700.0, gloss_width=0.01, sheen=sheen, sheen_width=0.041, sheen_water=0.0)
    assert false_with_glare(40, seed, lighting) == 0


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize('seed', range(21, 31))
def test_no_contact_in_10000_frames_with_glare_and_drift(seed):
    assert false_with_glare(1000, seed) == 0


class Untouched:
    """Dots and ranges of noisy untouched images: means and standard deviations of each dot's own, of the dots that each image shows."""

    def __init__(self, pad, frames=40):
        self.values = pad.values()
        self.sensor = Touchpad.from_parameters(self.values)
        self.camera = self.sensor.camera(pad.scene.camera.matrix, pad.scene.camera.distortion)
        tracker, water, uv, ranges, sigma = make_tracker(self.sensor, self.values), None, [], [], []
        for k, image in enumerate(noisy_frames(pad, frames, 2.0)):
            tracks = tracker.process(image, 1.0 + k)
            water = water or fit_rest(pad.rest[0], tracks.uv, self.camera, self.sensor.cap)
            for kept, found in zip((ranges, sigma), water.depths(image, tracks, self.camera)):
                kept.append(spread(tracks.id, found))
            uv.append(spread(tracks.id, tracks.uv))
        self.id = np.flatnonzero(np.isfinite(ranges).all(axis=0))
        self.uv, self.uv_noise = np.mean(uv, axis=0)[self.id], np.std(uv, axis=0)[self.id]
        self.range_noise, self.sigma = np.std(ranges, axis=0)[self.id], np.mean(sigma, axis=0)[self.id]
        self.rest = self.sensor.cap.meet(self.camera.centre, self.camera.rays(self.uv))

    def false_contacts(self, count, seed=7):
        """Frames of `count` with that noise in which the membrane and the contact stage find anything."""
        places = np.full((529, 3), np.nan)
        places[self.id] = self.rest
        membrane = Membrane(places, self.sensor.rows, self.sensor.columns, self.sensor.material)
        contact, state, false = ContactEstimator(self.sensor, self.camera, self.values), None, 0
        rng, ranges = np.random.default_rng(seed), np.linalg.norm(self.rest - self.camera.centre, axis=1)
        for k in range(count):
            uv = self.uv + self.uv_noise * rng.standard_normal(self.uv.shape)
            seen = ranges + self.range_noise * rng.standard_normal(len(self.id))
            state = membrane.solve(self.camera.centre, self.camera.rays(uv), seen, self.sigma, self.id, state)
            tracks = DotTracks(23, 23, self.id, uv, np.full(len(uv), 50.0), np.full(len(uv), np.nan), uv - self.uv, state.xyz[self.id])
            false += not untouched(contact.process(tracks, 1 + 0.02 * k))
        return false


def spread(ids, values):
    """values (N, ...) of dots ids (N,) as (529, ...), NaN elsewhere."""
    out = np.full((529, *values.shape[1:]), np.nan)
    out[ids] = values
    return out


@pytest.fixture(scope='module')
def measured(pad):
    return Untouched(pad)


def test_the_noise_is_what_the_ranges_say(measured):
    assert 0.5 < np.median(measured.range_noise / measured.sigma) < 2


def test_no_contact_in_500_noisy_frames_of_dots(measured):
    assert measured.false_contacts(500) == 0


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_no_contact_in_10000_noisy_frames_of_dots(measured):
    assert measured.false_contacts(10_000) == 0


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize('level', [0, 2, 5])
def test_no_contact_in_1000_noisy_images(pad, level):
    assert false_images(pad, 1000, level) == 0
