# SPDX-License-Identifier: GPL-3.0-or-later
"""The file of `beamfit frf` as pyuff reads it, against what `beamfit import` reads from it."""

import argparse
import os
import subprocess
import sys
import tempfile

import pyuff

MODEL = """format: beamfit-model/1
beam: {length_m: 0.3}
parameters: {EI_beam_Nm2: 2.1, rho_beam_kgpm: 0.21, cDI_beam_sNm2: 2e-4, gamma_sNpm2: 0.05}
inputs: {hammer_N: {kind: point_force, at_m: 0.1}}
outputs: {accel_mps2: {kind: acceleration, at_m: 0.3}, tip_mps: {kind: velocity, at_m: 0.28}}
"""
FREQUENCY_RESPONSE, ACCELERATION, VELOCITY, FORCE = 4, 12, 11, 13
DIGITS = 1e-9  # both round to nine digits or better


def imported(program, directory, number):
    """[(frequency, response)] of response `number` of the file, by the program's own importer."""
    name = ("accel_mps2", "tip_mps")[number]
    record = os.path.join(directory, "back.csv")
    subprocess.run([program, "import", os.path.join(directory, "beam.uff"), "--channel", "#%d=%s/hammer_N_re" % (2 * number + 1, name),
                    "--channel", "#%d=%s/hammer_N_im" % (2 * number + 2, name), "-o", record, "--digits", "15", "--force"],
                   check=True, capture_output=True)
    with open(record, encoding="utf-8") as stream:
        rows = [line.split(",") for line in stream if line[0] not in "#f"]
    return [(float(row[0]), complex(float(row[1]), float(row[2]))) for row in rows]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default="build")
    program = os.path.abspath(os.path.join(parser.parse_args().build, "beamfit"))
    with tempfile.TemporaryDirectory() as directory:
        with open(os.path.join(directory, "beam.yaml"), "w", encoding="utf-8") as stream:
            stream.write(MODEL)
        subprocess.run([program, "frf", os.path.join(directory, "beam.yaml"), "--to", "600", "--step", "0.5", "-o",
                        os.path.join(directory, "beam.uff")], check=True, capture_output=True)
        sets = pyuff.UFF(os.path.join(directory, "beam.uff")).read_sets()
        assert len(sets) == 2
        for number, quantity in enumerate((ACCELERATION, VELOCITY)):
            read, own = sets[number], imported(program, directory, number)
            assert read["func_type"] == FREQUENCY_RESPONSE and len(read["data"]) == len(own) == 1200
            assert read["ordinate_spec_data_type"] == quantity and read["orddenom_spec_data_type"] == FORCE
            largest = max(abs(h) for _, h in own)
            assert max(abs(x - f) for x, (f, _) in zip(read["x"], own)) < DIGITS * 600
            assert max(abs(h - g) for h, (_, g) in zip(read["data"], own)) < DIGITS * largest
    print("pyuff %s reads the frequency responses of beamfit frf" % pyuff.__version__)
    return 0


if __name__ == "__main__":
    sys.exit(main())
