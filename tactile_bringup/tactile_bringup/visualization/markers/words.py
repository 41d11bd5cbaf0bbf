# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The numbers and the state of a touch in words, for markers and pictures."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from tactile_msgs.msg import Slip

SLIP_NAMES = {Slip.NONE: 'no slip', Slip.INCIPIENT: 'incipient slip', Slip.GROSS: 'gross slip'}


def touch_words(found: Mapping) -> list[str]:
    """Depth, force and slip state, as far as they are known, from messages by topic (contacts, wrench, slip; any may be missing)."""
    contacts = found['contacts'].contacts if 'contacts' in found else []
    depths = [contact.depth for contact in contacts if np.isfinite(contact.depth)]
    forces = [contact.force for contact in contacts if np.isfinite(contact.force)]
    words = [f'{1e3 * max(depths):.1f} mm deep' if depths else '']
    if 'wrench' in found:
        words.append(force_word(found['wrench'].wrench.force))
    elif forces:
        words.append(f'{sum(forces):.2f} N')
    words.append(SLIP_NAMES.get(found['slip'].state, '') if 'slip' in found else '')
    return [word for word in words if word]


def force_word(force) -> str:
    """Magnitude of the force; its z component where only that is known; '' where neither is."""
    size = float(np.linalg.norm([force.x, force.y, force.z]))
    if np.isfinite(size):
        return f'{size:.1f} N'
    return f'{abs(force.z):.1f} N along z' if np.isfinite(force.z) else ''
