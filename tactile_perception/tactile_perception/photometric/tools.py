# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""calibrate of a photometric gel: depth by presses of a ball, which it finds in recordings, and force by known weights."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode

from ..bags.stamped import find_prefix
from ..common.progress import progress
from ..common.residuals import Residuals, write_and_report
from ..core.calibration_file import CalibrationFile, Specimen, read_calibration, write_calibration
from ..core.errors import BadCalibration, BadFrame
from ..core.parameter_files import read_parameters
from ..layer.tools import fit_modulus, load_report, read_loads
from .calibration import BallFit, Press, draw_circles
from .circles import CircleSearch
from .constants import PHOTOMETRIC
from .model import averaged
from .observation import Background, to_working_size
from .parameters import PHOTOMETRIC_NODE, PHOTOMETRIC_PARAMETERS, SENSOR
from .stage import PhotometricStage


def calibrate_balls(bags: list[Path], params: Path, output: Path, namespace: str = '', serial: str = '',
                    sphere_radius: float | None = None) -> str:
    """Fit slope against colour to presses of a ball, and write the calibration file.

    Parameters
    ----------
    bags : list of Path
        Recordings of images. Each begins with a second of the untouched gel; then a ball is pressed at many positions.
    params, output, namespace, serial
        See `SensorType.calibrate`.
    sphere_radius : float
        Radius of the ball in m.

    Returns
    -------
    str
        Report.

    Raises
    ------
    BadCalibration
        If the radius of the ball or gel.scale is missing, or the recordings show too few presses.
    """
    values = read_parameters(params, PHOTOMETRIC_NODE, PHOTOMETRIC_PARAMETERS)
    if sphere_radius is None or not 0 < sphere_radius < 0.1:
        raise BadCalibration('the radius of the ball is needed: give it in m, as --sphere-radius 0.0025')
    if not values['gel.scale'] > 0:
        raise BadCalibration(f'{params}: gel.scale, the length in m that one pixel shows, is needed to calibrate')
    left_out: list[str] = []
    presses, backgrounds, width = _read_all(bags, namespace, left_out)
    pixel = values['gel.scale'] * width / backgrounds[0].shape[1]  # m, of a working image
    fit = BallFit(presses, sphere_radius / pixel)
    left_out += fit.left_out
    presses, model, errors = fit.presses, replace(fit.model(backgrounds), field=values['gel.scale'] * width), fit.errors
    draw_circles(output.with_name(output.stem + '_circles.png'), fit)
    position = 1e3 * pixel * np.array([circle[:2] for circle in fit.circles])
    away = np.linalg.norm(errors.position, axis=1)
    residuals = [Residuals(name, 'mm', 1e3 * pixel * value, position, ('x, mm', 'y, mm'), [press.name for press in presses])
                 for name, value in (('depth', errors.depth), ('position', away))]
    millimetres = {f'{name}_rms_mm': 1e3 * pixel * float(np.sqrt(np.mean(value**2))) for name, value in
                   (('depth', errors.depth), ('position', away), ('untouched', errors.untouched))}
    content = CalibrationFile(
        SENSOR, {'noise': 'squared relative change'} | dict.fromkeys(('depth_sigma', 'position_sigma', 'skirt'), 'widths of the image')
        | {'field': 'm'},
        {name: getattr(model, name) for name in model.__dataclass_fields__ if name not in ('modulus', 'force_error')}, millimetres,
        {'x_mm': _range(position[:, 0]), 'y_mm': _range(position[:, 1]), 'slope': [0.0, float(np.max(fit.steepest()))]}, left_out,
        serial=serial, parameters=Specimen(serial, values).parameters(SENSOR))
    rows, columns = backgrounds[0].shape[:2]
    return write_and_report(output, content, residuals, [
        f'{len(presses)} presses of a ball of {1e3 * sphere_radius:g} mm radius, on {fit.covered:.0%} of the image of '
        f'{1e3 * pixel * columns:.1f} x {1e3 * pixel * rows:.1f} mm' + (
            '; depth is uncertain elsewhere: press the ball there, too' if fit.covered < PHOTOMETRIC.min_covered else ''),
        'errors at presses that were left out of the fit: shape of the ball {depth_rms_mm:.3f} mm RMS, position {position_rms_mm:.3f} mm '
        'RMS, untouched skin {untouched_rms_mm:.3f} mm RMS'.format(**millimetres),
        f'standard deviation of a depth: {model.slope_error:.1%} of it and {1e3 * model.depth_sigma * values["gel.scale"] * width:.3f} mm',
        f'circles, to be checked: {output.with_name(output.stem + "_circles.png")}'])


def calibrate_weights(bags: list[Path], params: Path, output: Path, namespace: str = '', serial: str = '',
                      weight: float | None = None) -> str:
    """Fit the modulus of a gel to known weights, and write the calibration file, which has the depths of the earlier one.

    Parameters
    ----------
    bags : list of Path
        Recordings of images. Each begins with a second of the untouched gel; then a known weight presses an object on it.
    params : Path
        Parameter file, whose `calibration` is the file with the depths.
    output, namespace, serial
        See `SensorType.calibrate`.
    weight : float, optional
        Force in N that presses in each recording; None: the recordings contain `ground_truth/wrench`.

    Returns
    -------
    str
        Report.

    Raises
    ------
    BadCalibration
        If depths are not calibrated, gel.thickness is not known, or a recording contains no press with a known load.
    """
    values, left_out = read_parameters(params, PHOTOMETRIC_NODE, PHOTOMETRIC_PARAMETERS), []
    if not values['calibration']:
        raise BadCalibration(f'{params}: the parameter calibration is empty; calibrate depth with a ball first (--sphere-radius), and '
                             'put in the name of its file')
    if not values['gel.thickness']:
        raise BadCalibration(f'{params}: forces depend on gel.thickness; measure it')
    content = read_calibration(values['calibration'], SENSOR, values)

    def new_stage() -> PhotometricStage:
        """A stage whose modulus is 1 Pa."""
        stage = PhotometricStage(values | {'gel.markers': False})
        stage.model = replace(stage.model, modulus=1.0)
        stage.reset()
        return stage

    sigma = float(np.hypot(PHOTOMETRIC.shape_error, content.fitted['slope_error']))
    loads = read_loads(bags, new_stage, lambda force, stage: sigma * force, namespace, weight, left_out)
    fit, newtons = fit_modulus(loads), [load.newtons for load in loads]
    write_calibration(output, replace(
        content, units=content.units | {'modulus': 'Pa', 'force_error': 'of the force'},
        fitted=content.fitted | {'modulus': fit.value, 'force_error': fit.force_sigma},
        residuals=content.residuals | {'force_scatter': fit.scatter, 'loads': len(loads)},
        calibrated_range=content.calibrated_range | {'force': [min(newtons), max(newtons)]}, left_out=content.left_out + left_out,
        serial=serial or content.serial))
    return load_report(loads, fit, 'modulus', left_out, output)


def calibrate_gel(*given: object, sphere_radius: float | None = None, weight: float | None = None, **named: object) -> str:
    """Calibrate depth with a ball (`calibrate_balls`), or, without the radius of one, force with known weights (`calibrate_weights`).

    Raises BadCalibration for both at once."""
    if sphere_radius is not None and weight is not None:
        raise BadCalibration('give --sphere-radius, to calibrate depth, or --weight, to calibrate force, and not both')
    if sphere_radius is None:
        return calibrate_weights(*given, weight=weight, **named)
    return calibrate_balls(*given, sphere_radius=sphere_radius, **named)


def _read_all(bags: list[Path], namespace: str, left_out: list[str]) -> tuple[list[Press], list[np.ndarray], int]:
    """Presses of all recordings, working images of the untouched gel, and width of the images in px. Raises BadCalibration."""
    presses, backgrounds, width = [], [], 0
    for bag in bags:
        background, found, width = read_presses(bag, namespace, left_out)
        presses += found
        backgrounds.append(background.image)
    if len({image.shape for image in backgrounds}) > 1:
        raise BadCalibration('the recordings have images of different sizes; calibrate with those of one')
    return presses, backgrounds, width


def _range(values: np.ndarray) -> list[float]:
    return [float(values.min()), float(values.max())]


def read_presses(bag: Path, namespace: str, left_out: list[str]) -> tuple[Background, list[Press], int]:
    """The untouched gel, the presses of a recording, and the width of its images in px. Raises BadCalibration where it has none."""
    frames = _images(bag, namespace, left_out)
    first = next(frames, None)
    if first is None:
        raise BadCalibration(f'{bag}: no usable colour image' + (f'; last problem: {left_out[-1]}' if left_out else ''))
    untouched, pressed, width = [to_working_size(first[1])], [], first[1].shape[1]
    search, background = None, None
    for stamp, image in frames:
        working = to_working_size(image)
        if working.shape != untouched[0].shape:
            left_out.append(f'{bag.name} at {1e-9 * stamp:.2f} s: another image size')
            continue
        if stamp - first[0] < 1e9 * PHOTOMETRIC.untouched_s:
            untouched.append(working)
            continue
        if background is None:
            background = Background(np.mean(untouched, axis=0, dtype=np.float32))
            search, noise = CircleSearch(background.shape), _noise_of(background, untouched)
        change, hidden = background.change(working), background.hidden(working)
        if float(np.mean(averaged(change * ~hidden[..., None])**2)) > noise:
            pressed.append(Press(f'{bag.name} at {1e-9 * stamp:.2f} s', working, change, hidden, search.find(change, hidden)))
            _keep_deepest(pressed)
    if background is None:
        raise BadCalibration(f'{bag}: shorter than {PHOTOMETRIC.untouched_s:g} s: record the untouched gel for a second, then the presses')
    return background, pressed, width


def _images(bag: Path, namespace: str, left_out: list[str]) -> Iterator[tuple[int, np.ndarray]]:
    """Stamp in ns and pixels (H, W, 3) of the colour images of a recording."""
    with BagReader(bag) as reader:
        topic = find_prefix(reader.topics, namespace) + 'image_raw'
        for raw in progress(reader.messages({topic}), f'images of {bag.name}'):
            message = decode(raw.data, raw.type_name)
            try:
                image = image_to_array(message)
                if image.ndim != 3:
                    raise BadFrame('a grey image; the shape comes from the colours')
                yield stamp_ns_of(message.header), image
            except BadFrame as error:
                left_out.append(f'{bag.name}: {error}')


def _noise_of(background: Background, untouched: list[np.ndarray]) -> float:
    """Mean square of averaged changes that a press exceeds: four times that of the untouched images, and of a change of 1 % in a thousandth
    of the image."""
    squares = [float(np.mean(averaged(background.change(image))**2)) for image in untouched]
    return max(4 * max(squares), 1e-7)


def _keep_deepest(pressed: list[Press]) -> None:
    """Of the last two images only the one with more evidence, where both show the same press: the circles overlap by their centres."""
    if len(pressed) > 1:
        last, new = pressed[-2:]
        if np.hypot(last.circle.x - new.circle.x, last.circle.y - new.circle.y) < max(last.circle.radius, new.circle.radius):
            pressed[-2:] = [max(last, new, key=lambda press: press.circle.evidence)]
