#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""run.py --build DIR [NAME...]: the tests on emulated boards; every test prints what it counted. Status 1: one failed."""
import argparse
import json
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "live"))
import board
import driver
import emulator
import power
import wire
from checks import Failure, check
from emulator import in_build
from library import LINEAR_GOAL, test_bits, test_costs, test_counts, test_units  # they run with those below

LIVE_SAMPLES = 150_000
STORES_WITHOUT_STALL = 2
ERASE_NS = 100_000_000  # of a stall that is emulated instruction by instruction; a real sector takes 1 s, at most 2
INTERRUPT_REST = 1700  # of it beside the step: BEAM_IMAGE_INTERRUPT of lib/beam_image.h, which every budget subtracts
BUILT_IN_STEP = 256
INTERRUPT_BOUND = 2000  # instructions of the sample interrupt with a linear model
DOWNLOADS = 100 if os.environ.get("FULL") else 4
KILLS, FIRMWARE_KILLS = (500, 100) if os.environ.get("FULL") else (60, 15)
CUT_EVERY = 1 if os.environ.get("FULL") else 12  # operations of a store


def six_laws(target, model):
    shutil.copy("data/live/model.yaml", model)
    for effect in ("coulomb_friction", "cubic_stiffness", "microslip", "stop_contact", "patch_softening", "bilinear_stiffness"):
        target.beamfit("add", model, effect, "-o", model + ".new")
        os.replace(model + ".new", model)


def test_deadline(build):
    """A model whose step may not fit is refused before a step of it, and the largest that is taken misses no sample."""
    if not emulator.has_plugin_board(build):
        return
    with tempfile.TemporaryDirectory() as folder:
        model, image = os.path.join(folder, "model.yaml"), os.path.join(folder, "model.img")
        target = board.Board(build, folder, plant="data/live/mass.txt")
        try:
            six_laws(target, model)
            target.beamfit("export", model, "-o", image, "--core-MHz", "500")
            raw = open(image, "rb").read()
            link = wire.Link(target.port, timeout_s=2.0)
            link.connect()
            info = link.info()
            link.unlock(open(target.key, "rb").read())
            link.stage(wire.signed(raw, open(target.key, "rb").read(), info.stored + 1, info.device))
            try:
                link.switch()
                raise Failure("the board took a model whose step may not fit")
            except wire.Refused as refused:
                check(refused.code == wire.ERROR_PAGE, f"refused with {refused.code:#x}")
            after = link.info()
            link.command(b"\xFE")
            link.close()
            check(wire.FAULTS[after.last_fault] == "too slow" and after.missed == 0, f"{after}")
            target.beamfit("export", model, "-o", image)
            target.insist("download", image, "--port", target.port, "--key", target.key_text)
            target.insist("record", "--port", target.port, "--key", target.key_text, "--baud", "921600", "--chirp", "5:200:2:5", "--settle", "0.1",
                           "--samples", "1000", "-o", os.path.join(folder, "run.csv"))
            ran = target.info()
        finally:
            target.end()
        check(ran["missed"] == 0 and ran["step_bound"] <= ran["step_budget"], f"{ran}")
        check(ran["proof_us"] * 125 <= ran["step_bound"], f"a step of the proof run took longer than its bound: {ran}")
        print(f"  six laws with all their evaluations refused ({after.last_fault}: too slow); with fewer, bound {ran['step_bound']} of "
              f"{ran['step_budget']}: taken, longest step of the proof run {ran['proof_us']} us, 0 missed")


def test_power(build):
    """Power cut inside operations on the emulated STM32's flash, words and erases; FULL=1 takes every operation."""
    if not emulator.has_plugin_board(build):
        return
    chains = power.power_cuts(build, CUT_EVERY)
    lost = [text for c in chains for text in c.lost]
    total = {n: sum(getattr(c, n) for c in chains) for n in ("lives", "cuts", "words", "erases", "kept", "taken")}
    check(not lost, f"{len(lost)} lost, first: {lost[:1]}")
    check(total["cuts"] > 100 and total["words"] > 50 and total["erases"] > 0, f"too little was cut: {total}")
    print(f"  {total['lives']} lives, {total['cuts']} cuts ({total['words']} inside words, {total['erases']} inside sector "
          f"erases): the old image {total['kept']} times, the new one {total['taken']} times, lost 0")


def test_kills(build):
    """SIGKILL at random while the mps2 board stores images one after the other; FULL=1: 500 kills."""
    done = power.random_kills(build, KILLS)
    seen, stores, lost = sum(d[0] for d in done), sum(d[1] for d in done), [text for d in done for text in d[2]]
    check(not lost, f"{len(lost)} lost, first: {lost[:1]}")
    check(seen >= KILLS // 2 and stores > seen, f"too little was killed: {seen} lives, {stores} stores")
    print(f"  {KILLS} kills, {seen} after the store was read, {stores} images stored, lost 0")


def test_port(build):
    """The firmware's other ports, Cortex-M4 and M7: downloads to a board that is killed in the middle; what it then runs."""
    for name, machine in (("mps2", "mps2-an386"), ("an500", "mps2-an500")):
        with tempfile.TemporaryDirectory() as folder:
            kills, done, lost = power.second_port(build, folder, FIRMWARE_KILLS, name, machine)
        check(not lost, f"{name}: {len(lost)} lost, first: {lost[:1]}")
        check(done > 0, f"{name}: no download came through")
        print(f"  {machine}: {kills} kills inside downloads, {done} downloads came through, lost 0")


def test_product(build):
    """The firmware on the emulated STM32 with the beam at its converters: download, drive, >= 1e5 samples, bit for bit."""
    if not emulator.has_plugin_board(build):
        return
    with tempfile.TemporaryDirectory() as folder:
        image, live = os.path.join(folder, "model.img"), os.path.join(folder, "live.bin")
        target = board.Board(build, folder, [f"live={live}", f"live_at={board.live_address(build)}", f"stop={LIVE_SAMPLES}"],
                             shift=5, plant="data/live/mass.txt")
        try:
            target.beamfit("export", "data/live/model.yaml", "-o", image)
            target.insist("download", image, "--port", target.port, "--key", target.key_text)
            target.insist("record", "--port", target.port, "--key", target.key_text, "--baud", "921600", "--chirp", "5:200:8:5", "--settle", "0.1",
                           "--samples", "4000", "--prescale", "10", "--force", "-o", os.path.join(folder, "run.csv"))
            info = target.info()
            target.process.wait(timeout=240)
        finally:
            target.end()
        check(info["missed"] == 0 and info["counter"] >= 1 and info["slots"][0] == "valid", f"{info}")
        found = re.search(r"conversions (\d+)", target.report())
        check(found and int(found[1]) == LIVE_SAMPLES, target.report()[-300:])
        done = subprocess.run([in_build(build, "replay_live"), live, image], capture_output=True, text=True, check=False)
        check(done.returncode == 0, f"{done.stdout}{done.stderr}")
        compared, same, rms = done.stdout.split()
        check(int(compared) >= 100_000 and float(rms) > 50.0, f"too little was driven: {done.stdout}")
        print(f"  {LIVE_SAMPLES} conversions, none missed; {compared} samples after the download replayed here, {same} equal")


def test_downloads(build):
    """Downloads in a row to the emulated STM32, stored each: no sample missed, none without its place in the sequence."""
    if not emulator.has_plugin_board(build):
        return
    with tempfile.TemporaryDirectory() as folder:
        image, live = os.path.join(folder, "model.img"), os.path.join(folder, "live.bin")
        target = board.Board(build, folder, [f"live={live}", f"live_at={board.live_address(build)}"], plant="data/live/mass.txt")
        try:
            target.beamfit("export", "data/live/model.yaml", "-o", image)
            for _ in range(DOWNLOADS):
                target.insist("download", image, "--port", target.port, "--key", target.key_text)
            info = target.info()
        finally:
            target.end()
        check(info["missed"] == 0 and info["counter"] == info["stored"] >= DOWNLOADS and info["refused"] == 0, f"{info}")
        with open(live, "rb") as file:
            sequence = [row[0] for row in struct.iter_unpack("<I44x", file.read())]
        check(sequence == list(range(len(sequence))), "the sequence of samples has a gap")
        print(f"  {DOWNLOADS} downloads during {len(sequence)} samples, 0 missed; longest sample interrupt {info['worst_step_us']} us")


def test_driver(build):
    """The driver of every board by itself: memory, samples, port; on those with a power to cut, cut anywhere and started again."""
    found = driver.everywhere(build, 1 if os.environ.get("FULL") else 97, emulator.has_plugin_board(build))
    for name, (lives, cuts, wrong) in found.items():
        print(f"  {name:16s} {lives} lives, {cuts} of them cut; wrong: {len(wrong)}")
    wrong = [f"{name}: {text}" for name, row in found.items() for text in row[2]]
    check(not wrong, wrong[:1])
    check(found["driver_template"][1] > 10 and found["driver_host"][1] > 10, "nothing was cut")


def test_roles(build):
    """One key unlocks, another signs, both in the sector where production puts them: neither does the other's work."""
    if not emulator.has_plugin_board(build):
        return
    wrong = driver.roles(build)
    check(not wrong, wrong)
    print("  the one key does not sign, the other does not unlock; together, and the one with a signed image, they do")


def used_up_flash(path):
    """Slots 0 and 1 in their last windows, which hold something: the next erase of each is one of its sector."""
    window, windows, sector = 8192, 16, 0x20000
    flash = bytearray(b"\xFF" * 3 * sector)
    for slot in (1, 2):
        for w in range(windows - 1):
            struct.pack_into("<I", flash, slot * sector + (w + 1) * window - 4, 0)
        struct.pack_into("<I", flash, slot * sector + (windows - 1) * window, 0)
    with open(path, "wb") as file:
        file.write(flash)


def to_last_window(path, slot):
    """What the slot's first window holds goes to its last one, all before it used up: its next erase is one of the sector."""
    window, windows, begin = 8192, 16, 0x20000 * (slot + 1)
    with open(path, "r+b") as file:
        flash = bytearray(file.read())
        last = begin + (windows - 1) * window
        flash[last:last + window] = flash[begin:begin + window]
        for w in range(windows - 1):
            struct.pack_into("<I", flash, begin + (w + 1) * window - 4, 0)
        file.seek(0)
        file.write(flash)


def test_stall(build):
    """Sectors are erased before sampling where that can be; one that is erased while the board samples counts every missed conversion."""
    if not emulator.has_plugin_board(build):
        return
    with tempfile.TemporaryDirectory() as folder:
        image, live = os.path.join(folder, "model.img"), os.path.join(folder, "live.bin")
        used_up_flash(os.path.join(folder, "flash.bin"))
        target = board.Board(build, folder, [f"live={live}", f"live_at={board.live_address(build)}", f"erase_ns={ERASE_NS}"],
                             plant="data/live/mass.txt")
        try:
            target.beamfit("export", "data/live/model.yaml", "-o", image)
            for _ in range(STORES_WITHOUT_STALL):  # slots that hold nothing valid were erased at power-on
                target.insist("download", image, "--sign", "--port", target.port, "--key", target.key_text)
                check(target.info()["missed"] == 0, f"{target.info()}")
        finally:
            target.end()
        print(f"  both slots used up: erased before sampling; {STORES_WITHOUT_STALL} stores, 0 missed")
        to_last_window(os.path.join(folder, "flash.bin"), 1)
        target = board.Board(build, folder, [f"live={live}", f"live_at={board.live_address(build)}", f"erase_ns={ERASE_NS}"],
                             plant="data/live/mass.txt")
        try:
            for store in range(2):  # the first goes to the slot that is not in use, the second has to erase the other one's sector
                target.insist("download", image, "--sign", "--port", target.port, "--key", target.key_text)
                info = target.info()
                check(store > 0 or info["missed"] == 0, f"the first store after a power-on missed {info['missed']}")
        finally:
            target.end()
        with open(live, "rb") as file:
            sequence = [row[0] for row in struct.iter_unpack("<I44x", file.read())]
        gaps = [b - a - 1 for a, b in zip(sequence, sequence[1:]) if b != a + 1]
        due = ERASE_NS / 1e6  # at 1 kHz
        check(len(gaps) == 1 and gaps[0] == info["missed"], f"gaps {gaps[:9]}, missed {info['missed']}")
        check(abs(info["missed"] - due) <= 2, f"{info['missed']} missed, due were {due:g}")
        check(info["slots"] == ["valid", "valid"] and info["stored"] == info["counter"] > 0, f"{info}")
        print(f"  {len(sequence)} samples around an erase of {ERASE_NS * 1e-9:g} s: missed {info['missed']}, the sequence has one gap of "
              f"{gaps[0]}; the image is stored")


TRACKED_MODEL = {"EI_beam_Nm2": 0.505, "EI_patch_Nm2": 0.798, "rho_patch_kgpm": 0.441, "cDI_beam_sNm2": 0.637e-5, "cDI_patch_sNm2": 1.275e-5,
                 "gamma_sNpm2": 0.3, "Ks_V": 40}  # what data/live/mass.txt says, but for the mass
TRACKED_TRUTH = ((6.4939, 0.03712), (37.6624, 0.00755), (94.1724, 0.00572))  # frequency and damping with it, by the truth simulator


def test_tracking(build):
    """A beam that is 0.4 g heavier than its model, driven now and then: the board's frequencies and dampings are the truth's."""
    if not emulator.has_plugin_board(build):
        return
    with tempfile.TemporaryDirectory() as folder:
        image, model = os.path.join(folder, "model.img"), os.path.join(folder, "model.yaml")
        with open("data/live/model.yaml", encoding="utf-8") as source, open(model, "w", encoding="utf-8") as out:
            text = source.read()
            for name, value in TRACKED_MODEL.items():
                text = re.sub(rf"({name}: *{{value: )[^,}}]*", rf"\g<1>{value:g}", text)
            out.write(text)
        target = board.Board(build, folder, [], plant="data/live/mass.txt")
        try:
            target.beamfit("export", model, "--track", "-o", image)
            target.insist("download", image, "--port", target.port, "--key", target.key_text)
            monitor = ("monitor", "--port", target.port, "--baud", "921600", "--json")
            for _ in range(3):  # each drive ends with its session: then the beam moves freely
                target.insist(*monitor, "--key", target.key_text, "--chirp", "4:204:4:7", "--seconds", "4")
                last = target.insist(*monitor, "--seconds", "3", "--every", "1")
        finally:
            target.end()
        modes = json.loads(last.strip().splitlines()[-1])["modes"]
        check(len(modes) == len(TRACKED_TRUTH), f"{last}")
        for number, (mode, (frequency, damping)) in enumerate(zip(modes, TRACKED_TRUTH), 1):
            off = (mode["frequency_Hz"] - frequency) / mode["frequency_se_Hz"]
            damped = (mode["damping_ratio"] - damping) / mode["damping_ratio_se"]
            print(f"  mode {number}: {mode['frequency_Hz']:.4f} +- {mode['frequency_se_Hz']:.4f} Hz (true {frequency}), damping "
                  f"{mode['damping_ratio']:.5f} +- {mode['damping_ratio_se']:.5f} ({damping}), gain {mode['gain']:.3f}")
            check(abs(off) < 3 and abs(damped) < 3 and mode["frequency_se_Hz"] < 0.03 * frequency, f"off by {off:.1f}, {damped:.1f} standard errors")


def test_resets(build):
    """A converter that dies, a pointer that is spoilt: the STM32 starts again by its watchdog, by a fault, and says so."""
    if not emulator.has_plugin_board(build):
        return
    app = board.symbols(in_build(build, "firmware_stm32f405.elf"))["app"][0]
    for reason, plugin in (("watchdog", ["dead=3000"]), ("fault", [f"poke={app:#x}", "poke_at=3000"])):
        with tempfile.TemporaryDirectory() as folder:
            live = os.path.join(folder, "live.bin")
            target = board.Board(build, folder, [*plugin, f"live={live}", f"live_at={board.live_address(build)}"], plant="data/live/mass.txt")
            try:
                first = target.info()
                deadline = time.monotonic() + 60
                while (info := target.info())["reset"] == "power" and time.monotonic() < deadline:
                    time.sleep(0.2)
            finally:
                target.end()
            wanted = {"power": 1, "pin": 0, "fault": 0, "watchdog": 0}
            check(first["reset"] == "power" and first["resets"] == wanted, f"{first}")
            check(info["reset"] == reason and info["resets"] == {**wanted, reason: 1} and info["boots"] == first["boots"] + 1, f"{info}")
            with open(live, "rb") as file:
                sequence = [row[0] for row in struct.iter_unpack("<I44x", file.read())]
            begins = sum(b < a for a, b in zip(sequence, sequence[1:]))
            check(begins == 1 and 0 < sequence[-1] < len(sequence), f"it does not sample again: {begins}, {sequence[-5:]}")
        print(f"  {reason}: started again by itself, {info['resets']}, {info['boots']} starts in the store; it samples again")


def test_stack(build):
    """Bytes of stack that the STM32's firmware really writes while it takes and runs a model with laws."""
    if not emulator.has_plugin_board(build):
        return
    top = board.address_of(in_build(build, "firmware_stm32f405.elf"), "board_stack_top") - 0x20000000
    with tempfile.TemporaryDirectory() as folder:
        model, image = os.path.join(folder, "model.yaml"), os.path.join(folder, "model.img")
        target = board.Board(build, folder, [f"stack={top}", "stop=9000"], plant="data/live/mass.txt")
        try:
            shutil.copy("data/live/model.yaml", model)
            for effect in ("coulomb_friction", "cubic_stiffness", "drive_hysteresis"):
                target.beamfit("add", model, effect, "-o", model + ".new")
                os.replace(model + ".new", model)
            target.beamfit("export", model, "-o", image)
            target.insist("download", image, "--port", target.port, "--key", target.key_text)
            target.insist("record", "--port", target.port, "--key", target.key_text, "--baud", "921600", "--chirp", "5:200:2:5", "--settle", "0.1",
                           "--samples", "500", "--force", "-o", os.path.join(folder, "run.csv"))
            target.process.wait(timeout=120)
        finally:
            target.end()
        found = re.search(r"stack: (\d+) of (\d+)", target.report())
        check(found, target.report()[-300:])
        print(f"  {found[1]} of {found[2]} bytes written: download, laws, drive, stream; `make size` has the computed worst")
        check(1000 < int(found[1]) < int(found[2]), "a stack that overflows, or that nobody used")


def test_interrupt(build):
    """Instructions of the whole sample interrupt of the STM32's firmware, alone and while it streams."""
    if not emulator.has_plugin_board(build):
        return
    elf = in_build(build, "firmware_stm32f405.elf")
    span = [f"begin={board.symbols(elf)['board_sample_isr'][0] & ~1:#x}",
            *(f"end={at:#x}" for at in board.returns_of(elf, "board_sample_isr"))]
    worst = []
    for streams in (False, True):
        with tempfile.TemporaryDirectory() as folder:
            target = board.Board(build, folder, [*span, *([] if streams else ["stop=3000"])], shift=3, plant="data/live/mass.txt")
            try:
                if streams:
                    target.insist("record", "--port", target.port, "--key", target.key_text, "--baud", "921600", "--chirp", "5:200:2:5", "--settle", "0.1",
                                   "--samples", "2000", "--force", "-o", os.path.join(folder, "run.csv"))
                else:
                    target.process.wait(timeout=120)
            finally:
                target.end()
            found = re.search(r"instructions: mean (\d+), largest (\d+) of (\d+)", target.report())
            check(found, target.report()[-300:])
            mean, largest = int(found[1]), int(found[2])
            worst.append(largest)
            print(f"  {'streaming, driven' if streams else 'alone':18s} mean {mean}, largest {largest} of {found[3]}: "
                  f"{largest * 1e3 / emulator.CLOCK_HZ:.2%} of a 1 kHz period, {largest * 1e4 / emulator.CLOCK_HZ:.1%} of 10 kHz")
    check(max(worst) - BUILT_IN_STEP <= INTERRUPT_REST, f"beside the step the interrupt takes {max(worst) - BUILT_IN_STEP}")
    check(max(worst) <= INTERRUPT_BOUND, f"the interrupt takes {max(worst)} instructions, the bound is {INTERRUPT_BOUND}")


def test_shares(build):
    """Instructions of step (built-in model and export's), observer, tracking and whole interrupt, streaming and driven; the largest have the
    port's interrupt in them, the interrupt's the proof run."""
    if not emulator.has_plugin_board(build):
        return
    elf = in_build(build, "firmware_stm32f405.elf")
    for name, function, options, bound in (("step", "beamt_step", (), LINEAR_GOAL), ("observer", "beamt_image_observe", (), 400),
                                           ("tracking", "track_sample", ("--track",), 1680),
                                           ("interrupt", "board_sample_isr", (), 1600)):
        span = [f"begin={board.symbols(elf)[function][0] & ~1:#x}", *(f"end={at:#x}" for at in board.returns_of(elf, function))]
        with tempfile.TemporaryDirectory() as folder:
            image = os.path.join(folder, "model.img")
            target = board.Board(build, folder, span, plant="data/live/mass.txt")
            try:
                target.beamfit("export", "data/live/model.yaml", *options, "-o", image)
                target.insist("download", image, "--port", target.port, "--key", target.key_text)
                target.insist("record", "--port", target.port, "--key", target.key_text, "--baud", "921600", "--chirp", "5:200:2:5", "--settle",
                              "0.1", "--samples", "1500", "--force", "-o", os.path.join(folder, "run.csv"))
            finally:
                target.end()
            found = re.search(r"instructions: mean (\d+), largest (\d+) of (\d+)", target.report())
            check(found, target.report()[-300:])
            print(f"  {name:10s} mean {found[1]}, largest {found[2]} of {found[3]}")
            check(0 < int(found[1]) <= bound, f"{name} takes {found[1]} instructions, the bound is {bound}")
            check(int(found[2]) <= INTERRUPT_BOUND or name == "interrupt", f"{name} takes {found[2]} instructions at most")


def main():
    tests = {name[5:]: test for name, test in globals().items() if name.startswith("test_")}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default="build")
    parser.add_argument("name", nargs="*", choices=[[], *tests], help="of a test")
    arguments = parser.parse_args()
    if emulator.version() is None:
        print("target: qemu-system-arm is not installed: tools/deps.sh target", file=sys.stderr)
        return 1
    failed = 0
    for name in arguments.name or tests:
        print(f"{name}: {tests[name].__doc__}", flush=True)
        begin = time.monotonic()
        try:
            tests[name](arguments.build)
            print(f"  ok ({time.monotonic() - begin:.1f} s)", flush=True)
        except (Failure, subprocess.SubprocessError) as error:
            failed += 1
            print(f"  FAILED: {error}", flush=True)
    print(f"target: {failed} failed" if failed else "target: all passed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
