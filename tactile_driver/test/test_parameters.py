# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The tables of parameters, and checks across them."""

import math

import pytest
import yaml

from tactile_driver.errors import BadArgument
from tactile_driver.parameters.drivers import (
    CAMERA_PARAMETERS,
    DUAL_CAMERA_PARAMETERS,
    PSD_DRIVER_PARAMETERS,
    TAXEL_DRIVER_PARAMETERS,
    check_pair,
    check_together,
)
from tactile_driver.parameters.table import Parameter, defaults, to_yaml

RATE = Parameter('rate', float, 30.0, 'Hz', 'frames a second', 0.0, 100.0)
MODE = Parameter('mode', str, 'fast', '', 'how', choices=('fast', 'exact'))
SCALE = Parameter('scale', float, math.nan, '', 'NaN where unknown')
OFFSETS = Parameter('offsets', list[float], [1.0, 2.0], 'mm', 'where', 0.0, 10.0)


@pytest.mark.parametrize(('parameter', 'value', 'converted'), [
    (RATE, 20, 20.0), (RATE, 0.0, 0.0), (RATE, 100.0, 100.0), (MODE, 'exact', 'exact'), (OFFSETS, [3, 4], [3.0, 4.0]),
    (OFFSETS, (3.0,), [3.0]),
    (Parameter('device', str, '', '', ''), 12345, '12345'), (Parameter('flag', bool, False, '', ''), True, True),
    (Parameter('names', list[str], [], '', ''), ['a'], ['a'])])
def test_good_values_come_back_in_the_right_type(parameter, value, converted):
    assert parameter.checked(value) == converted
    assert type(parameter.checked(value)) is type(converted)


@pytest.mark.parametrize(('parameter', 'value'), [
    (RATE, -1.0), (RATE, 100.1), (RATE, math.nan), (RATE, math.inf), (RATE, 'abc'), (RATE, True), (RATE, None), (RATE, [1.0]),
    (MODE, 'slow'),
    (OFFSETS, [1.0, 11.0]), (OFFSETS, ['a']), (OFFSETS, 3.0), (OFFSETS, 'abc'), (Parameter('flag', bool, False, '', ''), 1),
    (Parameter('count', int, 0, '', ''), 1.5)])
def test_a_wrong_value_is_named_with_what_is_allowed(parameter, value):
    with pytest.raises(BadArgument) as refusal:
        parameter.checked(value)
    for part in (f'parameter {parameter.name}', repr(value), parameter.allowed):
        assert part in str(refusal.value)


def test_nan_is_only_good_where_it_means_unknown():
    assert math.isnan(SCALE.checked(math.nan))


@pytest.mark.parametrize('broken', [{'type': dict, 'default': {}}, {'type': float, 'default': 5.0, 'lowest': 6.0}])
def test_a_table_that_contradicts_itself_is_found_at_once(broken):
    with pytest.raises(BadArgument):
        Parameter('x', unit='', text='', **broken)


def test_the_yaml_file_holds_the_defaults():
    table = (RATE, MODE, SCALE, OFFSETS)
    read = yaml.safe_load(to_yaml(table, '/**/node'))['/**/node']['ros__parameters']
    assert math.isnan(read.pop('scale'))
    assert read == {'rate': 30.0, 'mode': 'fast', 'offsets': [1.0, 2.0]}


TABLES = pytest.mark.parametrize('table', [CAMERA_PARAMETERS, PSD_DRIVER_PARAMETERS, TAXEL_DRIVER_PARAMETERS])


@TABLES
@pytest.mark.parametrize(('changes', 'named'), [({'source': 'bag'}, 'path'), ({'rate': -0.5}, 'rate'), ({'frame_id': ''}, 'frame_id')])
def test_what_does_not_fit_together_is_named(table, changes, named):
    with pytest.raises(BadArgument, match=f'parameter {named}'):
        check_together(defaults(table) | changes)


@pytest.mark.parametrize(('changes', 'named'), [
    ({'source': 'file'}, 'path'), ({'source': 'file', 'path': 'a'}, 'right_path'), ({'source': 'device', 'right_device': '0'}, 'device'),
    ({'source': 'topics', 'right_topic': 'left/image_raw'}, 'topic'), ({'source': 'bag', 'path': 'a', 'topic': 'x', 'right_topic': 'x'},
                                                                      'topic'), ({'frame_id': ''}, 'frame_id')])
def test_what_does_not_fit_together_is_named_dual(changes, named):
    with pytest.raises(BadArgument, match=f'parameters? {named}'):
        check_pair({**defaults(DUAL_CAMERA_PARAMETERS), **changes})
