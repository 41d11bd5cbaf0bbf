# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The plate's stage: counts of the load cells in, contacts out."""
import numpy as np
from sensor_msgs.msg import Image

from tactile_driver.nodes.messages.conversions import point, vector
from tactile_driver.nodes.messages.images import grey_to_array
from tactile_driver.parameters.table import Parameter
from tactile_msgs.msg import Contact, Contacts
from tactile_perception.core.calibration_file import read_calibration
from tactile_perception.core.stage import Input, Stage

PARAMETERS = (
    Parameter('rows', int, 2, '', 'rows of load cells', 2, 2),
    Parameter('columns', int, 2, '', 'columns of load cells', 2, 2),
    Parameter('size', float, 0.2, 'm', 'distance between neighbouring cells', 0.001, 10.0),
    Parameter('count', float, 0.1, 'N', 'force of one count, where no calibration states it', 1e-6, 1e3),
    Parameter('min_force', float, 1.0, 'N', 'force above which something touches', 1e-6, 1e6),
    Parameter('calibration', str, '', '', 'calibration file from calibrate'),
)


def centre_of_force(loads, size):
    """Where the resultant of the loads attacks.

    Parameters
    ----------
    loads : ndarray, shape (2, 2)
        Force on each cell, in N; the first row is at positive y.
    size : float
        Distance between neighbouring cells, in m.

    Returns
    -------
    tuple of float, shape (3,)
        Position in the sensor frame, in m.
    """
    force, half = loads.sum(), size / 2
    return half * (loads[:, 1] - loads[:, 0]).sum() / force, half * (loads[0] - loads[1]).sum() / force, 0.0


class PlateStage(Stage):
    """image_raw, a pixel a load cell -> contacts: the force and its point of attack."""

    node, outputs, parameters = 'plate_node', {'contacts': Contacts}, PARAMETERS
    input = Input('image_raw', Image, depth=10)

    def __init__(self, values):
        super().__init__(values)
        calibrated = values['calibration'] and read_calibration(values['calibration'], 'plate', values).fitted
        self._newtons = calibrated['newtons_per_count'] if calibrated else values['count']
        self.reset()

    def reset(self):
        """Take the next frame as the unloaded one."""
        self._unloaded = None

    set_reference = reset

    def estimate(self, message, stamp_s, topics):
        """The contact of one frame, if there is one."""
        counts = grey_to_array(message, 'plate').astype(float)
        if self._unloaded is None:
            self._unloaded = counts
        loads = self._newtons * (counts - self._unloaded)
        contacts = []
        if loads.sum() >= self.values['min_force']:
            contacts = [Contact(id=1, position=point(centre_of_force(loads, self.values['size'])), normal=vector((0.0, 0.0, 1.0)),
                                depth=np.nan, force=loads.sum(), position_covariance=[np.nan] * 9)]
        return {'contacts': [Contacts(header=message.header, contacts=contacts)]}
