# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.parameters.drivers import DUAL_CAMERA_PARAMETERS, check_pair
from tactile_driver.parameters.table import defaults


@pytest.mark.parametrize(('changes', 'named'), [
    ({'source': 'file'}, 'path'), ({'source': 'file', 'path': 'a'}, 'right_path'), ({'source': 'device', 'right_device': '0'}, 'device'),
    ({'source': 'topics', 'right_topic': 'left/image_raw'}, 'topic'), ({'source': 'bag', 'path': 'a', 'topic': 'x', 'right_topic': 'x'},
                                                                      'topic'), ({'frame_id': ''}, 'frame_id')])
def test_what_does_not_fit_together_is_named(changes, named):
    with pytest.raises(BadArgument, match=f'parameters? {named}'):
        check_pair({**defaults(DUAL_CAMERA_PARAMETERS), **changes})
