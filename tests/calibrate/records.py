# SPDX-License-Identifier: GPL-3.0-or-later
"""From a rig and what hides in it to model.yaml and records on disk: beam_truth makes exact channels, the instruments here spoil them."""

import hashlib
import math
import os
import random
import resource
import subprocess
import tempfile
import threading

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SIMULATE_LIMIT_S = 60  # of processor for one record; a stiff law of a fast beam may ask for hours
SLOPE_CORNERS = 6  # first-order noises, an octave and a half apart, that add up to a slope of about 1/f in power
RUNNING, LOCK, STOPPED = set(), threading.Lock(), threading.Event()


class Stopped(Exception):
    """Ctrl-C: children were ended, nothing may be stored."""


def run(command, limit_s):
    """(status or None when it used up limit_s of processor time, stdout, stderr, processor seconds). Own session: Ctrl-C does not reach it."""
    def limit():
        resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(limit_s), math.ceil(limit_s) + 5))
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        with LOCK:
            if STOPPED.is_set():
                raise Stopped()
            child = subprocess.Popen(command, stdout=out, stderr=err, stdin=subprocess.DEVNULL, start_new_session=True, preexec_fn=limit)
            RUNNING.add(child)
        _, status, usage = os.wait4(child.pid, 0)
        with LOCK:
            RUNNING.discard(child)
            child.returncode = os.waitstatus_to_exitcode(status)
            if STOPPED.is_set():
                raise Stopped()
        texts = []
        for stream in (out, err):
            stream.seek(0)
            texts.append(stream.read().decode("utf-8", "replace"))
    seconds = usage.ru_utime + usage.ru_stime
    dear = child.returncode != 0 and seconds >= 0.95 * limit_s
    return None if dear else child.returncode, texts[0], texts[1], seconds


def stop():
    """Ends what run() has started; every waiting run() then raises Stopped."""
    with LOCK:
        STOPPED.set()
        for child in RUNNING:
            child.kill()


def write_text(path, text):
    with open(path + ".new", "w", encoding="utf-8") as stream:
        stream.write(text)
    os.replace(path + ".new", path)


def source_hash():
    """Changes when the generator or the simulator does: then all is drawn again."""
    digest = hashlib.sha256()
    here = os.path.dirname(os.path.abspath(__file__))
    truth = os.path.join(TOP, "tests", "truth")
    paths = [os.path.join(here, name) for name in ("rigs.py", "effects.py", "records.py", "settle.py")]
    for path in paths + sorted(os.path.join(truth, name) for name in os.listdir(truth)):
        with open(path, "rb") as stream:
            digest.update(stream.read())
    return digest.hexdigest()[:16]


def read_csv(path):
    """{column: [values]} in the file's order."""
    with open(path, encoding="utf-8") as stream:
        lines = [line for line in stream if not line.startswith("#")]
    names = lines[0].strip().split(",")
    columns = list(zip(*(map(float, line.split(",")) for line in lines[1:])))
    return {name: list(column) for name, column in zip(names, columns)}


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def coloured(dice, noise, n, rate_Hz, mains_Hz):
    """n values of rms 1."""
    def first_order(a):
        x, out, drive = dice.gauss(0, 1), [], math.sqrt(1 - a * a)
        for _ in range(n):
            x = a * x + drive * dice.gauss(0, 1)
            out.append(x)
        return out
    if noise["colour"] == "autoregression":
        return first_order(noise["coefficient"])
    white = [dice.gauss(0, 1) for _ in range(n)]
    if noise["colour"] == "slope":
        parts = [first_order(math.exp(-2 * math.pi * 0.5 / 2.83 ** (k + 1))) for k in range(SLOPE_CORNERS)] + [white]
        return [sum(column) / math.sqrt(len(parts)) for column in zip(*parts)]
    if noise["colour"] == "line" and mains_Hz < 0.5 * rate_Hz:
        share, phase = noise["line"], dice.uniform(0, 2 * math.pi)
        turn = 2 * math.pi * mains_Hz / rate_Hz
        return [math.sqrt(1 - share) * w + math.sqrt(2 * share) * math.sin(phase + turn * i) for i, w in enumerate(white)]
    return white


def references(rig, exact):
    """{channel: (noise reference, largest value)} of the training records together, for common noise and range."""
    found = {}
    for name in list(rig.inputs) + list(rig.outputs):
        columns = [columns[name] for columns in exact.values() if name in columns]
        if columns:
            kind = rms if rig.noise[name]["of"] == "rms" else lambda c: max(map(abs, c))
            levels = [max(kind(c), 1e-300) for c in columns]
            found[name] = (math.exp(sum(map(math.log, levels)) / len(levels)), max(max(map(abs, c)) for c in columns))
    return found


def spoil(rig, record, name, exact, reference):
    """What stands in the file for the exact channel: gain, noise, a zero shift, converter."""
    dice = random.Random("beamfit instrument %d %s %s" % (rig.seed, record, name))
    noise, is_input = rig.noise[name], name in rig.inputs
    own_rms = rms(exact)
    own = own_rms if noise["of"] == "rms" else max(map(abs, exact))
    level = noise["level"] * (reference[0] if rig.common_noise else own)
    gain = rig.gain[name] * (rig.repeats[record] if name == "hammer_N" else 1)
    values = [gain * (x + level * e) for x, e in zip(exact, coloured(dice, noise, len(exact), rig.rate_Hz, rig.mains_Hz))]
    if (record, name) in rig.shift:
        share, settling_s = rig.shift[record, name]
        values = [v + gain * share * own_rms * math.exp(-i / rig.rate_Hz / settling_s) for i, v in enumerate(values)]
    if is_input and name == "drive_V":
        return values
    largest = gain * (reference[1] if rig.common_range else max(map(abs, exact)))
    step = rig.headroom * largest / 2 ** (rig.bits - 1)
    return [step * round(x / step) for x in values] if step > 0 else values


def header(rig, record):
    lines = ["# title: %s %s" % (rig.name, record), "# provenance: simulated by tests/truth, not measured", "# units: SI, in the column names"]
    if rig.filter_stated:
        lines.append("# anti-alias filter: Butterworth order %d at %.9g Hz%s" % (rig.filter_order, rig.filter_ratio * rig.rate_Hz,
                                                                               "" if rig.filter_causal else ", forward and backward"))
    return lines + (["# excitation: free_decay"] if rig.records[record]["decay"] else [])


def write_record(rig, record, exact, reference, directory):
    """The record as an experimenter has it."""
    taken, outputs = rig.channels(record)
    names = ([taken] if taken else []) + outputs
    columns = [spoil(rig, record, name, exact[name], reference[name]) for name in names]
    lines = header(rig, record) + ["time_s," + ",".join(names)]
    for i, row in enumerate(zip(*columns)):
        lines.append("%.10g," % (i / rig.rate_Hz) + ",".join("%.7g" % (x + 0.0) for x in row))
    write_text(os.path.join(directory, record + ".csv"), "\n".join(lines) + "\n")


def simulate(rig, record, more, truth_program, directory):
    """Exact channels of a record: {name: values}, or None when the simulator refuses or takes too long. Kept in directory."""
    os.makedirs(directory, exist_ok=True)
    text = "\n".join(rig.beam_lines() + rig.record_lines(record) + more) + "\n"
    spec, made = os.path.join(directory, record + ".txt"), os.path.join(directory, record + ".csv")
    if not (os.path.exists(made) and os.path.exists(spec + ".done") and open(spec + ".done", encoding="utf-8").read() == text):
        write_text(spec, text)
        status, _, message, _ = run([truth_program, spec, "-o", directory], SIMULATE_LIMIT_S)
        if status != 0:
            return None, "simulator: %s" % (message.strip() or "more than %d s" % SIMULATE_LIMIT_S)
        write_text(spec + ".done", text)
    return read_csv(made), ""
