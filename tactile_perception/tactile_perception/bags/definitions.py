# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Compares the message definitions in a recording with those of this software."""
from __future__ import annotations

from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore


def known_as(store: Typestore, kind: str, text: str) -> str:
    """Reason why messages of a type (std_msgs/msg/String) in a recording cannot be decoded, '' if they can; text: its recorded definition.

    A type unknown to store is added to it by that definition.
    """
    try:
        recorded = get_typestore(Stores.EMPTY)
        if text:
            recorded.register(get_types_from_msg(text, kind))
        if kind not in store.fielddefs and text:
            store.register({name: fields for name, fields in recorded.fielddefs.items() if name not in store.fielddefs})
        if kind not in store.fielddefs:
            return f'type {kind} is not known, nor defined in the recording'
        if text and recorded.hash_rihs01(kind) != store.hash_rihs01(kind):
            return f'type {kind} is defined otherwise in the recording: it was made by another version'
    except (TypesysError, KeyError) as error:
        return f'type {kind}: its definition in the recording cannot be read: {error}'
    return ''
