# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Small bags of strings, for the tests of this folder."""
from rosbag2_py import ConverterOptions, SequentialWriter, StorageOptions, TopicMetadata
from std_msgs.msg import String
from tactile_driver.recordings.serialization import encode, type_hash

TYPE = 'std_msgs/msg/String'


def encoded(text):
    return encode(String(data=text))[1]


def write_bag(path, count, size=300_000, first=0, preset=''):
    """Messages 'first', 'first + 1' ... followed by size incompressible bytes of text, on /a at 10 ns, 20 ns ..., as a bag; its file."""
    writer = SequentialWriter()
    writer.open(StorageOptions(uri=str(path), storage_id='mcap', storage_preset_profile=preset), ConverterOptions())
    writer.create_topic(TopicMetadata(id=0, name='/a', type=TYPE, serialization_format='cdr', type_description_hash=type_hash(TYPE)))
    for k in range(first, first + count):
        writer.write('/a', message(k, size), 10 * (k + 1))
    del writer  # closes it
    return next(file for file in path.iterdir() if file.name != 'metadata.yaml')


def message(number, size=300_000):
    filling = ''.join(chr(33 + (number * 7919 + j * j * 31 + j // 97) % 90) for j in range(1000)) * (size // 1000)
    return encoded(f'{number} {filling}')


def numbers(messages):
    """Of the messages, as they were written."""
    return [int(bytes(data[8:40]).split(b' ')[0].strip(b'\0')) for data in messages]
