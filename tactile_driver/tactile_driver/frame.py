# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Frames of one or two cameras or of a taxel array, blocks of voltages, and the calibration of a camera."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import yaml

from .errors import BadArgument, BadFrame

ENCODINGS = ('bgr8', 'mono8')
#: end of the name of a topic with compressed images, by image_transport's rule
COMPRESSED = '/compressed'


@dataclass(frozen=True)
class Frame:
    """One exposure.

    image: uint8 (H, W, 3) for bgr8, (H, W) for mono8; stamp_ns: time of exposure on the source's clock, ns; encoding: one of ENCODINGS;
    truth: TruthFrame of a simulated sensor, RecordedTruth of a recording that has it, else None.
    """

    image: np.ndarray
    stamp_ns: int
    encoding: str
    truth: object = None

    @property
    def sizes(self) -> dict[str, tuple[int, int]]:
        """(width, height) px by name of the view; a single view has the name ''."""
        return {'': self.image.shape[1::-1]}


@dataclass(frozen=True)
class PairFrame:
    """One exposure of two cameras. left, right: their frames, at most one of them None (missing); truth: as in Frame."""

    left: Frame | None
    right: Frame | None
    truth: object = None

    @property
    def stamp_ns(self) -> int:
        """Stamp of the left frame, or of the right frame if the left one is missing, ns."""
        return (self.left or self.right).stamp_ns

    @property
    def views(self) -> dict[str, Frame]:
        """The frames that are there, by name: left, right."""
        return {name: frame for name, frame in (('left', self.left), ('right', self.right)) if frame is not None}

    @property
    def sizes(self) -> dict[str, tuple[int, int]]:
        """(width, height) px of each present view, by its name."""
        return {name: frame.image.shape[1::-1] for name, frame in self.views.items()}


def frame_of(image: np.ndarray | None, place: str, stamp_ns: int) -> Frame:
    """A Frame from a decoded image: (H, W), (H, W, 1), (H, W, 3) BGR or (H, W, 4) BGRA, uint8. place: names the image in error messages.

    Raises BadFrame for None, an empty image, another type or another shape.
    """
    if image is None or image.size == 0:
        raise BadFrame(f'{place} cannot be decoded; it is skipped')
    if image.dtype != np.uint8 or image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] not in (1, 3, 4)):
        raise BadFrame(f'{place} is {image.dtype} of shape {image.shape}; 8-bit grey or colour is needed, it is skipped')
    if image.ndim == 3 and image.shape[2] == 4:
        image = cv2.cvtColor(image, cv2.COLOR_BGRA2BGR)
    if image.ndim == 3 and image.shape[2] == 1:
        image = image[:, :, 0]
    return Frame(image, stamp_ns, 'bgr8' if image.ndim == 3 else 'mono8')


def as_encoding(frame: Frame, encoding: str) -> np.ndarray:
    """The frame's image as mono8 (H, W) or bgr8 (H, W, 3); '' keeps the encoding."""
    if encoding in ('', frame.encoding):
        return frame.image
    return cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY if encoding == 'mono8' else cv2.COLOR_GRAY2BGR)


@dataclass(frozen=True)
class CameraCalibration:
    """The fields of sensor_msgs/CameraInfo: width, height, px; k (9,), r (9,) and p (12,) in row-major order; d: coefficients of the
    distortion model. A k of zeros means uncalibrated."""

    width: int
    height: int
    k: tuple = (0.0,) * 9
    d: tuple = ()
    r: tuple = (0.0,) * 9
    p: tuple = (0.0,) * 12
    model: str = ''


def pinhole_calibration(matrix: np.ndarray, distortion: np.ndarray, size: tuple[int, int]) -> CameraCalibration:
    """Calibration of a monocular camera; matrix: (3, 3) K, px; distortion: (5,) plumb_bob; size: (width, height), px."""
    k = np.asarray(matrix, float)
    p = np.hstack([k, np.zeros((3, 1))])
    d = np.asarray(distortion, float)
    return CameraCalibration(*size, *(tuple(x.ravel().tolist()) for x in (k, d, np.eye(3), p)), 'plumb_bob')


def calibration_of_info(info) -> CameraCalibration | None:
    """The calibration in a sensor_msgs/CameraInfo, None where it says that there is none."""
    if not (info.k[0] > 0 and info.k[4] > 0 and info.width and info.height):
        return None
    numbers = (tuple(map(float, values)) for values in (info.k, info.d, info.r, info.p))
    return CameraCalibration(info.width, info.height, *numbers, info.distortion_model)


def _numbers(document: dict, key: str, count: int | None, path: str) -> tuple:
    try:
        values = tuple(float(x) for x in document[key]['data'])
    except (KeyError, TypeError, ValueError) as error:
        raise BadArgument(f'camera_info_url: {path} has no numbers under {key}/data; write it with camera_calibration') from error
    if not np.isfinite(values).all() or (count is not None and len(values) != count):
        raise BadArgument(f'camera_info_url: {key} in {path} needs {count or "any number of"} finite numbers, got {values}')
    return values


def load_calibration(path: str) -> CameraCalibration | None:
    """The camera calibration in a YAML file of camera_calibration; path: path or file:// URL, '' for none. None without a file, in a folder
    that exists: set_camera_info may write it. Raises BadArgument for an unusable file."""
    name = path.removeprefix('file://')
    if not name or (not Path(name).exists() and Path(name).absolute().parent.is_dir()):
        return None
    try:
        document = yaml.safe_load(Path(name).read_text())
        size = int(document['image_width']), int(document['image_height'])
    except (OSError, UnicodeDecodeError, yaml.YAMLError, TypeError, KeyError, ValueError) as error:
        raise BadArgument(f'camera_info_url: {name} is not a camera calibration ({error!r}); write it with camera_calibration') from error
    k = _numbers(document, 'camera_matrix', 9, name)
    if k[0] <= 0 or k[4] <= 0 or min(size) <= 0:
        raise BadArgument(f'camera_info_url: {name} has focal lengths {k[0]}, {k[4]} px and size {size}; all must be above 0')
    others = [_numbers(document, key, count, name)
              for key, count in (('distortion_coefficients', None), ('rectification_matrix', 9), ('projection_matrix', 12))]
    return CameraCalibration(*size, k, *others, str(document.get('distortion_model', 'plumb_bob')))


def save_calibration(path: str, known: CameraCalibration) -> None:
    """Write the file that load_calibration reads. Raises BadArgument for a calibration or a place that cannot be used."""
    name = Path(path.removeprefix('file://'))
    fresh, matrices = name.with_name(f'{name.name}.new'), {
        'camera_matrix': (3, 3, known.k), 'distortion_coefficients': (1, len(known.d), known.d), 'rectification_matrix': (3, 3, known.r),
        'projection_matrix': (3, 4, known.p)}
    page = {'image_width': known.width, 'image_height': known.height, 'camera_name': name.stem, 'distortion_model': known.model,
            **{key: {'rows': rows, 'cols': columns, 'data': list(map(float, data))} for key, (rows, columns, data) in matrices.items()}}
    try:
        fresh.write_text(yaml.safe_dump(page, sort_keys=False))
        load_calibration(str(fresh))
        fresh.replace(name)
    except OSError as error:
        raise BadArgument(f'camera_info_url: {name} cannot be written: {error}') from error
    finally:
        fresh.unlink(missing_ok=True)


def in_sensor_order(matrix: np.ndarray, values: Mapping) -> np.ndarray:
    """The matrix with rows along the sensor's y axis and columns along x. values: transposed, first, then flip_rows and flip_columns."""
    matrix = matrix.T if values['transposed'] else matrix
    return np.ascontiguousarray(matrix[::-1 if values['flip_rows'] else 1, ::-1 if values['flip_columns'] else 1])


def sent_shape(values: Mapping) -> tuple[int, int]:
    """(rows, columns) of a matrix as the device sends it. values: rows and columns in the sensor's order; transposed."""
    shape = values['rows'], values['columns']
    return shape[::-1] if values['transposed'] else shape


def matrix_frame(values: np.ndarray, shape: tuple[int, int], stamp_ns: int, place: str, truth: object = None) -> Frame:
    """A Frame, mono8 or mono16, of whole numbers values (rows, columns). Raises BadFrame for another shape (0: any) or other numbers."""
    values = np.asarray(values)
    if values.ndim != 2 or any(wanted not in (0, found) for wanted, found in zip(shape, values.shape)) or not values.size:
        raise BadFrame(f'{place} is {" x ".join(map(str, values.shape))}, parameters rows and columns say {shape[0]} x {shape[1]}; '
                       'it is skipped')
    if values.dtype.kind not in 'ui':
        if not np.isfinite(values).all() or (values != np.round(values)).any():
            raise BadFrame(f'{place} has values that are no whole numbers; it is skipped')
    if values.min() < 0 or values.max() >= 2**16:
        raise BadFrame(f'{place} has values from {values.min()} to {values.max()}; 0 to 65535 can be published; it is skipped')
    small = values.dtype == np.uint8
    return Frame(values.astype(np.uint8 if small else np.uint16), stamp_ns, 'mono8' if small else 'mono16', truth)


CHANNELS = 4  # x1, y1, x2, y2


@dataclass(frozen=True)
class SampleBlock:
    """Consecutive samples without a gap.

    volts: (N, 4) float32, V, columns x1, y1, x2, y2, NaN where the converter gave no value; stamp_ns: time of the first sample on the
    source's clock, ns; period_s: sampling period, s, NaN for a single sample of unknown rate; truth: of a simulated finger,
    RecordedTruth of a recording that has it, else None.
    """

    volts: np.ndarray
    stamp_ns: int
    period_s: float
    truth: object = None

    @property
    def sizes(self) -> dict:
        """Empty: a block may have any length."""
        return {}
