# SPDX-License-Identifier: GPL-3.0-or-later
"""What an analyser does, in plain Python: transforms, averaged H1 with coherence, and a mode read from a peak."""

import cmath
import math


def transform(x):
    """Discrete Fourier transform; the length is a power of two."""
    n = len(x)
    if n == 1:
        return [complex(x[0])]
    even, odd = transform(x[0::2]), transform(x[1::2])
    turned = [cmath.exp(-2j * math.pi * k / n) * odd[k] for k in range(n // 2)]
    return [even[k] + turned[k] for k in range(n // 2)] + [even[k] - turned[k] for k in range(n // 2)]


def averaged(forces, answers):
    """H1 and coherence of spectra of hits: [hit][line] each."""
    response, coherence = [], []
    for k in range(len(forces[0])):
        ff = sum(abs(f[k]) ** 2 for f in forces)
        yy = sum(abs(y[k]) ** 2 for y in answers)
        yf = sum(y[k] * f[k].conjugate() for f, y in zip(forces, answers))
        response.append(yf / ff)
        coherence.append(abs(yf) ** 2 / (ff * yy))
    return response, coherence


def solve(matrix, right):
    """Gaussian elimination with pivoting."""
    n = len(right)
    rows = [list(matrix[i]) + [right[i]] for i in range(n)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda r: abs(rows[r][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for r in range(i + 1, n):
            factor = rows[r][i] / rows[i][i]
            rows[r] = [a - factor * b for a, b in zip(rows[r], rows[i])]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (rows[i][n] - sum(rows[i][j] * x[j] for j in range(i + 1, n))) / rows[i][i]
    return x


def mode_of(response, step_hz, frequency_hz, width_hz, rounds=8):
    """Frequency |p|/2 pi of (b0 + ... + b3 s^3)/(s^2 + a1 s + a0) fitted around a peak (Sanathanan and Koerner,
    1963), from the second round on with the fitted response as instrument, or its noise would bias the pole."""
    scale = 2 * math.pi * frequency_hz
    first, last = int((frequency_hz - width_hz) / step_hz), int((frequency_hz + width_hz) / step_hz) + 1
    a0, a1, b = 1.0, 0.02, None
    for _ in range(rounds):
        gram, right = [[0.0] * 6 for _ in range(6)], [0.0] * 6
        for k in range(max(first, 1), min(last, len(response) - 1) + 1):
            s, h = 2j * math.pi * k * step_hz / scale, response[k]
            weight = 1 / abs(s * s + a1 * s + a0) ** 2
            row = [h, h * s, -1, -s, -s * s, -s ** 3]
            fitted = h if b is None else sum(b[i] * s ** i for i in range(4)) / (s * s + a1 * s + a0)
            instrument = [fitted, fitted * s] + row[2:]
            for i in range(6):
                right[i] += weight * (-complex(instrument[i]).conjugate() * h * s * s).real
                for j in range(6):
                    gram[i][j] += weight * (complex(instrument[i]).conjugate() * row[j]).real
        a0, a1, *b = solve(gram, right)
    return scale * math.sqrt(a0) / (2 * math.pi)
