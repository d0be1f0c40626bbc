"""Logarithm and exponential for inner loops.

The C library's are exact to the last bit, and a call each. These are exact to 1e-13 and become part
of the loop they stand in, where the processor works on several at once; and they give the same bits
on every machine.
"""

from __future__ import annotations

import numpy as np

from curling_env.physics.compiled import inlined

_MANTISSA = np.int64(0x000FFFFFFFFFFFFF)
_ONE = np.int64(0x3FF0000000000000)
_LN2_HIGH = 6.93147180369123816490e-01
_LN2_LOW = 1.90821492927058770002e-10
_LOG2_E = 1.4426950408889634
_ROUNDER = 6755399441055744.0
"""1.5·2^52: adding it rounds a small number to a whole one, which then stands in its last bits."""
_SMALLEST, _LARGEST = -700.0, 700.0


@inlined
def quick_log(x: float) -> float:
    """Natural logarithm of a positive, normal number."""
    bits = np.float64(x).view(np.int64)
    exponent = float((bits >> 52) - 1023)
    m = np.int64((bits & _MANTISSA) | _ONE).view(np.float64)
    if m > 1.4142135623730951:
        m *= 0.5
        exponent += 1.0
    # 2·artanh(t) with |t| < 0.172, as a series to t^17.
    t = (m - 1.0) / (m + 1.0)
    w = t * t
    # In pairs, whose sums do not wait for each other.
    w2 = w * w
    low = (1 / 3 + w * (1 / 5)) + w2 * (1 / 7 + w * (1 / 9))
    high = (1 / 11 + w * (1 / 13)) + w2 * (1 / 15 + w * (1 / 17))
    series = w * (low + w2 * w2 * high)
    return exponent * _LN2_HIGH + (2.0 * t + (2.0 * t * series + exponent * _LN2_LOW))


@inlined
def quick_exp(x: float) -> float:
    """Exponential; beyond ±700 that of ±700."""
    x = min(max(x, _SMALLEST), _LARGEST)
    shifted = x * _LOG2_E + _ROUNDER
    whole = shifted - _ROUNDER
    r = (x - whole * _LN2_HIGH) - whole * _LN2_LOW
    # Taylor to r^11 with |r| < 0.347, in pairs, whose sums do not wait for each other.
    r2 = r * r
    r4 = r2 * r2
    low = (1.0 + r) + r2 * (1 / 2 + r * (1 / 6))
    middle = (1 / 24 + r * (1 / 120)) + r2 * (1 / 720 + r * (1 / 5040))
    high = (1 / 40320 + r * (1 / 362880)) + r2 * (1 / 3628800 + r * (1 / 39916800))
    scale = (np.float64(shifted).view(np.int64) + np.int64(1023)) << np.int64(52)
    return (low + r4 * (middle + r4 * high)) * np.int64(scale).view(np.float64)
