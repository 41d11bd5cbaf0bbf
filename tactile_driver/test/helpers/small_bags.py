# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Small bags of strings in any storage, whole and damaged, for the tests of this folder."""
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPE = 'std_msgs/msg/String'
STRING = STORE.types[TYPE]
MCAP, SQLITE = StoragePlugin.MCAP, StoragePlugin.SQLITE3
NONE, FILE, MESSAGE, STORAGE = CompressionMode.NONE, CompressionMode.FILE, CompressionMode.MESSAGE, CompressionMode.STORAGE


def encoded(text):
    return bytes(STORE.serialize_cdr(STRING(data=text), TYPE))


def write_bag(path, count, storage=MCAP, compression=NONE, size=300_000, first=0):
    """Messages 'first', 'first + 1' ... followed by size incompressible bytes of text, on /a at 10 ns, 20 ns ..., as a bag; its file."""
    writer = Writer(path, version=9, storage_plugin=storage)
    writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection('/a', TYPE, typestore=STORE)
        for k in range(first, first + count):
            writer.write(connection, 10 * (k + 1), message(k, size))
    return next(file for file in path.iterdir() if file.name != 'metadata.yaml')


def message(number, size=300_000):
    filling = ''.join(chr(33 + (number * 7919 + j * j * 31 + j // 97) % 90) for j in range(1000)) * (size // 1000)
    return encoded(f'{number} {filling}')


def numbers(messages):
    """Of the messages, as they were written."""
    return [int(bytes(data[8:40]).split(b' ')[0].strip(b'\0')) for data in messages]


def first_chunk(mcap):
    """Where the first chunk of an MCAP file's bytes begins: after the magic and the header."""
    return 8 + 9 + int.from_bytes(mcap[9:17], 'little')
