# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Frames of one camera, two cameras or a taxel array, blocks of voltages, and the calibration of a camera."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import yaml

from .errors import BadArgument, BadFrame

ENCODINGS = ('bgr8', 'mono8')
#: Suffix of topics with compressed images, as image_transport names them.
COMPRESSED = '/compressed'


@dataclass(frozen=True)
class Frame:
    """One exposure of a camera, or one matrix of a taxel array.

    Parameters
    ----------
    image : ndarray
        Pixels: uint8 of shape (H, W, 3) for ``bgr8``, uint8 of shape (H, W) for ``mono8``, uint16 of shape (H, W) for ``mono16``.
    stamp_ns : int
        Time of exposure on the clock of the source, in ns.
    encoding : str
        Encoding of the image, as sensor_msgs/Image names it.
    truth : TruthFrame or RecordedTruth, optional
        Ground truth of a simulated sensor, or of a recording that has it.
    """

    image: np.ndarray
    stamp_ns: int
    encoding: str
    truth: object = None

    @property
    def sizes(self) -> dict[str, tuple[int, int]]:
        """Width and height of the image in px, under the empty name of a single view."""
        return {'': self.image.shape[1::-1]}


@dataclass(frozen=True)
class PairFrame:
    """One exposure of two cameras.

    Parameters
    ----------
    left, right : Frame or None
        Frames of the cameras. At most one of them is missing (None).
    truth : TruthFrame or RecordedTruth, optional
        Ground truth, as in `Frame`.
    """

    left: Frame | None
    right: Frame | None
    truth: object = None

    @property
    def stamp_ns(self) -> int:
        """Stamp in ns of the left frame, or of the right frame if the left one is missing."""
        return (self.left or self.right).stamp_ns

    @property
    def views(self) -> dict[str, Frame]:
        """The frames that are not missing, under the names ``left`` and ``right``."""
        return {name: frame for name, frame in (('left', self.left), ('right', self.right)) if frame is not None}

    @property
    def sizes(self) -> dict[str, tuple[int, int]]:
        """Width and height in px of each view that is not missing, by its name."""
        return {name: frame.image.shape[1::-1] for name, frame in self.views.items()}


def frame_of(image: np.ndarray | None, label: str, stamp_ns: int) -> Frame:
    """Make a frame of a decoded image.

    Parameters
    ----------
    image : ndarray of uint8, or None
        Image of shape (H, W), (H, W, 1), (H, W, 3) in BGR order, or (H, W, 4) in BGRA order. None if decoding failed.
    label : str
        Name of the image in error messages.
    stamp_ns : int
        Time of exposure, in ns.

    Returns
    -------
    Frame
        The frame, with encoding ``mono8`` or ``bgr8``.

    Raises
    ------
    BadFrame
        If the image is None, empty, or of another type or shape.

    Examples
    --------
    >>> frame_of(np.zeros((480, 640, 1), np.uint8), 'image 1', 0).sizes
    {'': (640, 480)}
    """
    if image is None or image.size == 0:
        raise BadFrame(f'{label} cannot be decoded; it is skipped')
    if image.dtype != np.uint8 or image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] not in (1, 3, 4)):
        raise BadFrame(f'{label} is {image.dtype} of shape {image.shape}; 8-bit grey or colour is needed, it is skipped')
    if image.ndim == 3 and image.shape[2] == 4:
        image = cv2.cvtColor(image, cv2.COLOR_BGRA2BGR)
    if image.ndim == 3 and image.shape[2] == 1:
        image = image[:, :, 0]
    return Frame(image, stamp_ns, 'bgr8' if image.ndim == 3 else 'mono8')


def as_encoding(frame: Frame, encoding: str) -> np.ndarray:
    """Image of a frame in an encoding.

    Parameters
    ----------
    frame : Frame
        The frame.
    encoding : str
        ``mono8`` or ``bgr8``; empty for the encoding of the frame.

    Returns
    -------
    ndarray
        Image of shape (H, W) for ``mono8``, (H, W, 3) for ``bgr8``.
    """
    if encoding in ('', frame.encoding):
        return frame.image
    return cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY if encoding == 'mono8' else cv2.COLOR_GRAY2BGR)


@dataclass(frozen=True)
class CameraCalibration:
    """Calibration of a camera, with the fields of sensor_msgs/CameraInfo.

    Parameters
    ----------
    width, height : int
        Size of the image, in px.
    k : tuple of 9 float
        Camera matrix in row-major order, in px. Zeros mean that the camera is not calibrated.
    d : tuple of float
        Coefficients of the distortion model.
    r : tuple of 9 float
        Rectification matrix in row-major order.
    p : tuple of 12 float
        Projection matrix in row-major order, in px.
    model : str
        Name of the distortion model.
    """

    width: int
    height: int
    k: tuple = (0.0,) * 9
    d: tuple = ()
    r: tuple = (0.0,) * 9
    p: tuple = (0.0,) * 12
    model: str = ''


def pinhole_calibration(matrix: np.ndarray, distortion: np.ndarray, size: tuple[int, int]) -> CameraCalibration:
    """Calibration of a single camera.

    Parameters
    ----------
    matrix : ndarray, shape (3, 3)
        Camera matrix, in px.
    distortion : ndarray, shape (5,)
        Coefficients of the model ``plumb_bob``.
    size : tuple of int
        Width and height of the image, in px.

    Returns
    -------
    CameraCalibration
        The calibration, without rectification.
    """
    k = np.asarray(matrix, float)
    p = np.hstack([k, np.zeros((3, 1))])
    d = np.asarray(distortion, float)
    return CameraCalibration(*size, *(tuple(x.ravel().tolist()) for x in (k, d, np.eye(3), p)), 'plumb_bob')


def calibration_of_info(info) -> CameraCalibration | None:
    """Calibration of a camera_info message.

    Parameters
    ----------
    info : sensor_msgs.msg.CameraInfo
        The message.

    Returns
    -------
    CameraCalibration or None
        The calibration; None if the camera is not calibrated (a camera matrix of zeros).
    """
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
    """Read the camera calibration that camera_calibration has written.

    Parameters
    ----------
    path : str
        Path or file:// URL of a YAML file; empty for none.

    Returns
    -------
    CameraCalibration or None
        The calibration. None if no file is given, or if it does not exist yet in a folder that does: ``set_camera_info`` may write it.

    Raises
    ------
    BadArgument
        If the file is not a camera calibration.
    """
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
    """Write a file for `load_calibration`.

    Parameters
    ----------
    path : str
        Path or file:// URL of the YAML file.
    known : CameraCalibration
        The calibration.

    Raises
    ------
    BadArgument
        If the calibration cannot be used, or the file cannot be written.
    """
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
    """Bring a matrix of a device into the order of the sensor: rows along its y axis, columns along its x axis.

    Parameters
    ----------
    matrix : ndarray, shape (M, N)
        Values as the device sends them.
    values : Mapping
        Parameters of the driver: ``transposed``, which is applied first, ``flip_rows`` and ``flip_columns``.

    Returns
    -------
    ndarray
        Contiguous matrix.

    Examples
    --------
    >>> in_sensor_order(np.array([[1, 2], [3, 4]]), {'transposed': True, 'flip_rows': True, 'flip_columns': False})
    array([[2, 4],
           [1, 3]])
    """
    matrix = matrix.T if values['transposed'] else matrix
    return np.ascontiguousarray(matrix[::-1 if values['flip_rows'] else 1, ::-1 if values['flip_columns'] else 1])


def sent_shape(values: Mapping) -> tuple[int, int]:
    """Rows and columns of a matrix as the device sends it.

    Parameters
    ----------
    values : Mapping
        Parameters of the driver: ``rows`` and ``columns`` in the order of the sensor, and ``transposed``.

    Returns
    -------
    tuple of int
        Rows and columns.

    Examples
    --------
    >>> sent_shape({'rows': 6, 'columns': 14, 'transposed': True})
    (14, 6)
    """
    shape = values['rows'], values['columns']
    return shape[::-1] if values['transposed'] else shape


def matrix_frame(values: np.ndarray, shape: tuple[int, int], stamp_ns: int, label: str, truth: object = None) -> Frame:
    """Make a frame of the matrix of a taxel array.

    Parameters
    ----------
    values : ndarray, shape (rows, columns)
        Integers from 0 to 65535.
    shape : tuple of int
        Expected rows and columns; 0 for any.
    stamp_ns : int
        Time of sampling, in ns.
    label : str
        Name of the matrix in error messages.
    truth : TruthFrame or RecordedTruth, optional
        Ground truth, as in `Frame`.

    Returns
    -------
    Frame
        A frame with encoding ``mono8`` if the values are uint8, else ``mono16``.

    Raises
    ------
    BadFrame
        If the matrix has another shape, or a value cannot be published.

    Examples
    --------
    >>> matrix_frame(np.array([[0, 700]]), (1, 2), 0, 'row 1').encoding
    'mono16'
    """
    values = np.asarray(values)
    if values.ndim != 2 or any(wanted not in (0, found) for wanted, found in zip(shape, values.shape)) or not values.size:
        raise BadFrame(f'{label} is {" x ".join(map(str, values.shape))}, parameters rows and columns say {shape[0]} x {shape[1]}; '
                       'it is skipped')
    if values.dtype.kind not in 'ui':
        if not np.isfinite(values).all() or (values != np.round(values)).any():
            raise BadFrame(f'{label} has values that are not integers; it is skipped')
    if values.min() < 0 or values.max() >= 2**16:
        raise BadFrame(f'{label} has values from {values.min()} to {values.max()}; 0 to 65535 can be published; it is skipped')
    small = values.dtype == np.uint8
    return Frame(values.astype(np.uint8 if small else np.uint16), stamp_ns, 'mono8' if small else 'mono16', truth)


CHANNELS = 4  # x1, y1, x2, y2


@dataclass(frozen=True)
class SampleBlock:
    """Consecutive samples of a position sensitive detector, without a gap.

    Parameters
    ----------
    volts : ndarray of float32, shape (N, 4)
        Output voltages x1, y1, x2, y2, in V; NaN where the converter gave no value.
    stamp_ns : int
        Time of the first sample on the clock of the source, in ns.
    period_s : float
        Sampling period, in s; NaN for a single sample of unknown rate.
    truth : object, optional
        Ground truth of a simulated finger, or of a recording that has it.
    """

    volts: np.ndarray
    stamp_ns: int
    period_s: float
    truth: object = None

    @property
    def sizes(self) -> dict:
        """Empty, because a block may have any length."""
        return {}
