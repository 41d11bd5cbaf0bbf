# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The contact point of dots of which nothing is known."""
from dataclasses import replace

import numpy as np
from cap_with_dots import pad  # noqa: F401
from tactile_perception.touchpad.contact.contact_point import find_contact
from tactile_perception.touchpad.contact.region import find_regions


def test_depth_of_nothing_is_unknown(pad):  # noqa: F811
    dots = pad.disc()
    region = find_regions(dots)[0]
    for dots.xyz in (np.ones((529, 3)), np.full((529, 3), np.nan)):
        assert np.isnan(find_contact(dots, region, pad.cap).depth)
    nothing = replace(region, members=np.zeros(529, bool))
    assert np.isnan(find_contact(pad.disc(), nothing, pad.cap).depth)
