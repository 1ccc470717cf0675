#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""export.py — hit1.csv to hit4.csv of beam_truth, in this directory, as a laboratory's programs would have exported them.

    analyser.uff    hit 1 over time, UFF 58: force in N, acceleration in g, velocity in mm/s
    acquisition.mat hit 2, MATLAB 5: all in volts (22.5 mV/N, 100 mV/g, 5 mm/s/V), the rate as `Fs`
    scope.csv       hit 3: a table of ms, N, g and mm/s with semicolons and decimal commas
    frf.uff         frequency responses H1 of hits 1 to 3 with their coherence, UFF 58; exponential window of 0.3 s

Hit 4 stays as it is, to be held out, in the form of hit 3. The accelerometer is screwed on upside down. The CSV of hits 1 to 4 are removed."""

import cmath
import math
import os
import struct

G, RATE, WINDOW_S = 9.80665, 2048.0, 0.3


def read(name):
    rows = [line.split(",") for line in open(name) if line[0].isdigit()]
    time, force, accel, laser = ([float(row[c]) for row in rows] for c in range(4))
    os.remove(name)
    return time, force, [-a / G for a in accel], [1000 * v for v in laser]


# ---- UFF 58 ----

def uff_58(out, title, kind, complex_values, step, first, ordinate, over, values):
    """One dataset, double precision, even abscissa. kind: 1 time, 4 frequency response, 6 coherence; ordinate, over: type, name, unit."""
    axis = (18, "Frequency", "Hz") if kind != 1 else (17, "Time", "s")
    out.write("    -1\n    58\n")
    for line in (title, "NONE", "01-JAN-26 12:00:00", "NONE", "NONE"):
        out.write("%-80s\n" % line)
    out.write("%5d%10d%5d%10d %-10s%10d%4d %-10s%10d%4d\n" % (kind, 0, 0, 0, "NONE", 1, 3, "NONE", 2, 3))
    out.write("%10d%10d%10d%13.5e%13.5e%13.5e\n" % (6 if complex_values else 4, len(values), 1, first, step, 0))
    for quantity, name, unit in (axis, ordinate, over, (0, "NONE", "NONE")):
        out.write("%10d%5d%5d%5d %-20s %-20s\n" % (quantity, 0, 0, 0, name, unit))
    flat = [part for z in values for part in (z.real, z.imag)] if complex_values else values
    for k in range(0, len(flat), 4):
        out.write("".join("%20.11e" % x for x in flat[k:k + 4]) + "\n")
    out.write("    -1\n")


def write_times(name, record):
    time, *channels = record
    kinds = ((13, "Force", "N"), (12, "Accel", "g"), (11, "Velocity", "mm/s"))
    with open(name, "w") as out:
        for channel, ordinate in zip(channels, kinds):
            uff_58(out, ordinate[1], 1, False, 1 / RATE, time[0], ordinate, (0, "NONE", "NONE"), channel)


# ---- MATLAB 5 ----

def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)


def matrix(name, values):
    """A column of doubles."""
    body = element(6, struct.pack("<II", 6, 0)) + element(5, struct.pack("<ii", len(values), 1))
    body += element(1, name.encode()) + element(9, struct.pack("<%dd" % len(values), *values))
    return element(14, body)


def write_mat(name, record):
    _, force, accel, laser = record
    with open(name, "wb") as out:
        out.write(b"MATLAB 5.0 MAT-file, exported by the acquisition".ljust(124) + struct.pack("<HH", 0x0100, 0x4D49))
        out.write(matrix("Fs", [RATE]))
        out.write(matrix("force", [0.0225 * x for x in force]))
        out.write(matrix("accel", [0.1 * x for x in accel]))
        out.write(matrix("laser", [x / 5 for x in laser]))


# ---- A table ----

def write_table(name, record):
    with open(name, "w") as out:
        out.write("Zeit [ms];Kraft [N];Beschl. [g];Geschw. [mm/s]\n")
        for row in zip(*record):
            out.write(";".join("%.9g" % x for x in (1000 * row[0], *row[1:])).replace(".", ",") + "\n")


# ---- Frequency responses ----

def fft(x):
    if len(x) == 1:
        return x
    even, odd = fft(x[0::2]), fft(x[1::2])
    turned = [cmath.exp(-2j * math.pi * k / len(x)) * odd[k] for k in range(len(odd))]
    return [a + b for a, b in zip(even, turned)] + [a - b for a, b in zip(even, turned)]


def lines(record, channel):
    time, values = record[0], record[channel]
    return fft([x * math.exp(-t / WINDOW_S) for x, t in zip(values, time)])[:801]


def write_responses(name, records):
    with open(name, "w") as out:
        for channel, ordinate in ((2, (12, "Accel", "g")), (3, (11, "Velocity", "mm/s"))):
            spectra = [(lines(record, 1), lines(record, channel)) for record in records]
            response, coherence = [], []
            for k in range(801):
                uu = sum(abs(u[k]) ** 2 for u, z in spectra)
                zz = sum(abs(z[k]) ** 2 for u, z in spectra)
                uz = sum(u[k].conjugate() * z[k] for u, z in spectra)
                response.append(uz / uu)
                coherence.append(min(abs(uz) ** 2 / (uu * zz), 1.0))
            step, over = RATE / len(records[0][0]), (13, "Force", "N")
            uff_58(out, "H1 %s/Force" % ordinate[1], 4, True, step, 0.0, ordinate, over, response)
            uff_58(out, "Coherence %s/Force" % ordinate[1], 6, False, step, 0.0, ordinate, over, coherence)


def main():
    records = [read("hit%d.csv" % k) for k in (1, 2, 3, 4)]
    write_times("analyser.uff", records[0])
    write_mat("acquisition.mat", records[1])
    write_table("scope.csv", records[2])
    write_table("scope_held_out.csv", records[3])
    write_responses("frf.uff", records[:3])


if __name__ == "__main__":
    main()
