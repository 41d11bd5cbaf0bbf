# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What holds at the border of the compiled module: whatever array NumPy can make, a function answers or raises ValueError by name."""
import re

import numpy as np
import pytest


def unaligned(good):
    """The same numbers, without gaps, an odd number of bytes into memory."""
    moved = np.empty(good.nbytes + 1, np.uint8)[1:].view(good.dtype).reshape(good.shape)
    moved[...] = good
    return moved


def odd_arrays(good):
    """Name and array: all that NumPy can make in place of a good one."""
    rng = np.random.default_rng(2)
    yield 'empty', good[:0]
    yield 'no columns', good[..., :0]
    yield 'one', good[:1]
    yield 'a single number', np.zeros((), good.dtype)
    yield 'one dimension more', good[None]
    yield 'wrong type', good.astype(np.complex64)
    with np.errstate(over='ignore'):
        short = good.astype(np.float16)
    yield 'another wrong type', short
    yield 'whole numbers', np.zeros(good.shape, np.int64)
    yield 'objects', np.full(good.shape, None)
    yield 'text', np.full(good.shape, 'x')
    yield 'other byte order', good.astype(good.dtype.newbyteorder('>'))
    yield 'every second', np.repeat(good, 2, axis=0)[::2]
    yield 'backwards', good[::-1]
    yield 'column by column', np.asfortranarray(good)
    still = good.copy()
    still.flags.writeable = False
    yield 'read-only', still
    yield 'unaligned', unaligned(good)
    yield 'masked', np.ma.masked_array(good)
    yield 'ten thousand', np.resize(good, (10_000, *good.shape[1:]))
    yield 'ten thousand alike', np.broadcast_to(good[:1], (10_000, *good.shape[1:]))
    if good.dtype.kind == 'f':
        for value in (np.nan, np.inf, -np.inf, 1e300 if good.dtype == np.float64 else 1e38, 1e-300):
            yield f'all {value}', np.full_like(good, value)
        yield 'any numbers', (rng.standard_normal(good.shape) * 10.0**rng.integers(-30, 30, good.shape)).astype(good.dtype)
        yield 'some not finite', np.where(rng.random(good.shape) < 0.2, np.nan, good).astype(good.dtype)
    else:
        yield 'all the same', np.full_like(good, 7)


def check_any_array(call, arrays, name, refusal=ValueError):
    """call(**{name: array}) answers or raises an error that begins with an argument's name, for any array in place of arrays[name]."""
    answered = 0
    for kind, array in odd_arrays(arrays[name]):
        try:
            call(**{name: array})
            answered += 1
        except refusal as error:
            assert re.match(r'\w+: ', str(error)), kind
    assert answered >= 3


def check_wrong_type(call, arrays, name, refusal=ValueError):
    """A wrong type or shape is refused with the argument's name."""
    good = arrays[name]
    swapped = [good.astype(good.dtype.newbyteorder('>'))] if good.dtype.itemsize > 1 else []
    for wrong in (None, good.tolist(), 'text', good.astype(np.complex64), good[None], *swapped):
        with pytest.raises(refusal, match=f'^{name}: '):
            call(**{name: wrong})


def check_memory(call, arrays, name):
    """How an array lies in memory changes nothing."""
    good = arrays[name]
    still = good.copy()
    still.flags.writeable = False
    expected = call()
    for other in (np.asfortranarray(good), np.repeat(good, 2, axis=0)[::2], unaligned(good), still):
        for a, b in zip(expected, call(**{name: other})):
            np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(still, good)


def arrays_test(calls):
    """The test that any array is answered or refused by name, however it lies in memory. calls: name of a function -> how it is called,
    and an example of each of its arrays."""
    @pytest.mark.parametrize('check', [check_any_array, check_wrong_type, check_memory])
    @pytest.mark.parametrize('function, name', [(function, name) for function, (_, arrays) in calls.items() for name in arrays])
    def checked(function, name, check):
        check(*calls[function], name)
    return checked
