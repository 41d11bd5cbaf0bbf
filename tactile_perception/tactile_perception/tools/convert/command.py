# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""convert_recording: converts a recording of a camera sensor (sensor.json, frames, truth.npz), of a PSD finger or of a taxel array
(meta.json, input.npz, truth.npz) to a bag with ground truth, and writes the parameter file of its sensor beside the bag.
"""
from __future__ import annotations

import argparse
from itertools import chain
from pathlib import Path

from tactile_driver.errors import reports_errors
from tactile_driver.recordings.writer import write_messages

from ...common.messages import description_messages
from ...common.progress import progress
from ...core.parameter_files import write_parameters
from ...finger.tools import PsdRecording
from ...taxel.response import SENSOR as TAXEL_ARRAY
from .camera import Recording
from .taxel import TaxelRecording


def open_recording(path: Path) -> Recording | PsdRecording | TaxelRecording:
    """Open the recording of any sensor in a folder or file. Raises BadRecording."""
    meta = path / 'meta.json'
    if path.suffix == '.npz' or meta.exists() and TAXEL_ARRAY in meta.read_text(errors='replace'):
        return TaxelRecording(path)
    return (PsdRecording if meta.exists() else Recording)(path)


def convert(recording: Recording | PsdRecording | TaxelRecording, target: Path, namespace: str) -> None:
    """Write the recording to target, a new bag, with topics under /namespace.

    The bag begins with the description of the sensor and the static transforms of its own frames. Raises TactileError.
    """
    messages = recording.messages(namespace)
    first = next(messages)
    described = description_messages(first[0], str(recording.parameters()['sensor_type']), namespace,
                                     {'source': 'file', 'path': str(recording.path)}, recording.transforms(namespace))
    write_messages(target, namespace, progress(chain(described, [first], messages), 'messages'))


@reports_errors('convert_recording')
def main(args: list[str] | None = None) -> int:
    """Run the command; exit code 0, or 1 with a one-line error."""
    parser = argparse.ArgumentParser(prog='convert_recording', description=__doc__)
    parser.add_argument('input', type=Path, help='folder with sensor.json, frames/, truth.npz, or with meta.json, input.npz, truth.npz; '
                        '.npz with imprints of weights')
    parser.add_argument('output', type=Path, help='new rosbag2 folder; the parameter file goes beside it, as OUTPUT.yaml')
    parser.add_argument('--namespace', default='touchpad', help='namespace of the topics, and frame_id')
    given = parser.parse_args(args)
    recording = open_recording(given.input)
    convert(recording, given.output, given.namespace)
    params = given.output.with_name(given.output.name + '.yaml')
    write_parameters(params, recording.parameters())
    unit = 'samples' if isinstance(recording, PsdRecording) else 'frames'
    print(f'{given.output}: {len(recording)} {unit}; parameters of the sensor: {params}')
    return 0
