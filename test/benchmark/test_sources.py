# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sources give images, stamps and ground truth of equal length, and the parameters of their sensor."""
import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from tactile_perception.errors import BadArgument

_SPEC = importlib.util.spec_from_file_location('benchmark_sources', Path(__file__).with_name('sources.py'))
sources = importlib.util.module_from_spec(_SPEC)
sys.modules['benchmark_sources'] = sources  # dataclasses look their module up
_SPEC.loader.exec_module(sources)

NAMES = ('dot_contact', 'dot_state', 'dot_xyz', 'dot_gap', 'dot_slip', 'force', 'residual', 'touches')


@pytest.mark.parametrize('name', ['scene:impact', 'tp_disc_twist'])
def test_images_and_truth_belong_together(name):
    try:
        source = sources.open_source(name, rate=10.0)
    except BadArgument as error:
        pytest.skip(str(error))
    frames = list(source.frames(4))
    assert [stamp for stamp, _ in frames] == source.stamps[:4].tolist() and frames[0][0] >= sources.FIRST_STAMP
    assert frames[0][1].shape == (480, 640, 3) and frames[0][1].dtype == np.uint8
    assert {len(source.truth[n]) for n in NAMES} == {len(source.stamps)}
    touched = source.truth['dot_contact'].any(axis=1)
    assert 0 < touched.sum() < len(touched) and [bool(t) for t in source.truth['touches']] == touched.tolist()
    assert set(source.truth['loop_frame']) <= set(np.flatnonzero(touched))
    assert source.truth['loop_start'][-1] == len(source.truth['loop_xyz'])
    assert source.parameters['rows'] == source.parameters['columns'] == 23 and source.matrix.shape == (3, 3)


def test_a_scene_in_another_size():
    assert sources.open_source('scene:rest', size=(320, 240)).image(0).shape == (240, 320, 3)


def test_what_is_not_there_is_named(monkeypatch):
    monkeypatch.delenv('TACTILE_RECORDINGS', raising=False)
    with pytest.raises(BadArgument, match='TACTILE_RECORDINGS'):
        sources.open_source('tp_disc_twist')
    with pytest.raises(BadArgument, match='impact'):
        sources.open_source('scene:none')
