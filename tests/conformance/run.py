# SPDX-License-Identifier: GPL-3.0-or-later
"""pyxcp 0.29.20, a host that others wrote, on the board on the PC or the emulated product; pya2ldb on the A2L file."""
import argparse
import hashlib
import hmac
import logging
import os
import signal
import struct
import sys
import tempfile
import threading
import time
import warnings
import zlib

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "live"))
import rig  # noqa: E402
import wire  # noqa: E402

warnings.simplefilter("ignore")
from pyxcp import types  # noqa: E402
from pyxcp.config import create_application_from_config  # noqa: E402
from pyxcp.daq_stim import DaqList, DaqOnlinePolicy  # noqa: E402
from pyxcp.master import Master  # noqa: E402

sys.excepthook = sys.__excepthook__  # pyxcp installs one that prints every local variable, keys included

FIELDS = [("sequence", "U32"), ("step", "U32"), ("input", "F32"), ("measured", "F32"), ("predicted", "F32"),
          ("residual", "F32"), ("innovation", "F32"), ("ratio", "F32"), ("innovation_ratio", "F32"), ("codes", "U32"), ("status", "U32"), ("crc32", "U32")]
STREAM_SAMPLES = 3000  # of the board: its own time, since an emulated one on a busy machine has another than the wall
WALL_LIMIT_S = 300.0  # no verdict on time: only so that a board that has died ends the test


class Checks:
    def __init__(self):
        self.done = 0

    def __call__(self, what, fine):
        if not fine:
            raise rig.Failed(f"conformance: {what}")
        self.done += 1

    def refused(self, what, call, *codes):
        """The call must raise an XCP error of one of these codes."""
        try:
            call()
        except types.XcpResponseError as error:
            got = int(error.args[0].type if hasattr(error.args[0], "type") else error.args[0])
            self(f"{what}: refused with {got:#x} instead of {codes}", not codes or got in codes)
            return
        raise rig.Failed(f"conformance: {what}: not refused")


class Collect(DaqOnlinePolicy):
    """Every sample as pyxcp decoded it."""

    rows: list

    def initialize(self):
        self.rows = []

    def on_daq_list(self, daq_list, timestamp0, timestamp1, payload):
        self.rows.append(tuple(payload))

    def finalize(self):
        pass


def master(port, key, policy=None):
    app = create_application_from_config({"SxI": {}}, log_level=logging.CRITICAL)
    sxi = app.transport.sxi
    sxi.port, sxi.bitrate = port, 921600
    sxi.header_format, sxi.tail_format = "HEADER_LEN_CTR_WORD", "CHECKSUM_WORD"
    app.transport.layer, app.transport.timeout = "SXI", master.timeout_s
    app.general.connect_retries = 2
    app.general.disable_error_handling = True
    app.general.seed_n_key_function = lambda resource, seed: hmac.new(
        key, bytes([resource]) + bytes(seed), hashlib.sha256).digest()[:16]
    logging.disable(logging.CRITICAL)
    x = Master("SXI", config=app, policy=policy)
    request = x.transport.request

    def patient(command, *data):
        """Asks again after silence: a busy machine may stretch a frame beyond 50 ms of an emulated board's time."""
        for _ in range(master.patience):
            try:
                return request(command, *data)
            except types.XcpTimeoutError:
                master.repeats += 1
        return request(command, *data)

    x.transport.request = patient
    return x


master.repeats = 0
master.patience = 3
master.timeout_s = 1.0


def write_image(x, image):
    step = (x.slaveProperties["maxCto"] - 8) // 4 * 4
    for at in range(0, len(image), step):
        x.shortDownload(wire.IMAGE + at, 0, image[at:at + step])
    x.setMta(wire.IMAGE)
    return x.buildChecksum(len(image))


def read(x, address, n):
    x.setMta(address)
    return bytes(x.fetch(n))


def read_info(x):
    return wire.Info(*struct.unpack(wire.INFO_FORMAT, read(x, wire.INFO, wire.INFO_BYTES)))


def download(check, x, image, info, key):
    """Two bad images, then a good one; seconds that took."""
    flipped = bytearray(image)
    flipped[400] ^= 1
    x.setCalPage(0x02, 0, wire.STAGING)
    for bad in (bytes(flipped), wire.signed(image, bytes(byte ^ 1 for byte in key), info.counter + 1, info.device)):
        write_image(x, bad)
        check.refused("a bad image", lambda: x.setCalPage(0x01, 0, wire.STAGING), 0x26)
    start = time.monotonic()
    checksum = write_image(x, image)
    check("CRC-32", checksum.checksum == zlib.crc32(image) and checksum.checksumType == "XCP_CRC_32")
    x.setCalPage(0x01, 0, wire.STAGING)
    return time.monotonic() - start


def session(check, port, key, image):
    """One host from CONNECT to DISCONNECT. Returns seconds of the download and what was asked."""
    x = master(port, key)
    with x:
        hello = x.connect()
        check("MAX_CTO", hello.maxCto == 248 and hello.maxDto == 248)
        check("calibration and DAQ", x.slaveProperties["supportsCalpag"] and x.slaveProperties["supportsDaq"])
        x.getCommModeInfo()
        check("name", bytes(x.identifier(types.XcpGetIdType.FILENAME), "ascii") == b"beamfit")
        info = read_info(x)
        check("image length", info.image_bytes == len(image))
        check("locked", x.getCurrentProtectionStatus()["calpag"])
        check.refused("staging while locked", lambda: (x.setCalPage(0x02, 0, wire.STAGING),
                                                       x.shortDownload(wire.IMAGE, 0, image[:16])), 0x25)
        check.refused("storing while locked", lambda: x.setRequest(0x01, 0), 0x25)
        x.cond_unlock("calpag")
        check("unlocked", not x.getCurrentProtectionStatus()["calpag"])
        pages = x.getPagProcessorInfo()
        check("one segment", pages["maxSegments"] == 1)
        check("two pages", x.getSegmentInfo(0x01, 0, 0, 0)["maxPages"] == 2)
        x.setCalPage(0x02, 0, wire.ACTIVE)
        before = bytes(read(x, wire.IMAGE, info.image_bytes))
        check.refused("writing page 0", lambda: x.shortDownload(wire.IMAGE, 0, image[:16]), 0x23)

        seconds = download(check, x, image, info, key)
        x.setCalPage(0x02, 0, wire.ACTIVE)
        check("active page of the ECU", x.getCalPage(0x01, 0) == wire.ACTIVE)
        check("the new image runs", read(x, wire.IMAGE, len(image)) == image and image != before)
        x.copyCalPage(0, wire.ACTIVE, 0, wire.STAGING)
        x.setCalPage(0x02, 0, wire.STAGING)
        check("copied page", read(x, wire.IMAGE, len(image)) == image)
        x.setRequest(0x01, 0)
        while x.getStatus().sessionStatus["storeCalRequest"]:
            time.sleep(0.02)
        info = read_info(x)
        check("stored", info.stored == info.counter == struct.unpack_from("<I", image, 12)[0])
        check("two images refused", info.refused == 2)
        x.disconnect()
    return seconds, x.transport


def wrong_key(check, port):
    x = master(port, b"\2" * 32)
    with x:
        x.connect()
        x.getCommModeInfo()
        check.refused("a wrong key", lambda: x.cond_unlock("calpag"), 0x25)
        patience, master.patience = master.patience, 0 if master.timeout_s > 1.0 else 2
        try:
            x.getStatus()
            silent = False
        except types.XcpTimeoutError:
            silent = True
        master.patience = patience
        check("disconnected after a wrong key", silent)


def stream(check, port, key, prescaler=1):
    """(samples that came, that did not, that came a second), as pyxcp decodes them, one in prescaler, over STREAM_SAMPLES of the board. Every CRC must be right, and the board
    must have counted every sample that did not come: a busy machine may leave no room on the line."""
    measurements = [(name, wire.LIVE + 4 * i, 0, kind) for i, (name, kind) in enumerate(FIELDS)]
    policy = Collect([DaqList(name="live", event_num=0, stim=False, enable_timestamps=True, measurements=measurements,
                              priority=0, prescaler=prescaler)], logger=logging.getLogger("conformance"))
    policy.pid_off = False  # pyxcp reads it and sets it only from a configuration file
    x = master(port, key, policy)
    with x:
        x.connect()
        x.getCommModeInfo()
        overrun_before = read_info(x).overrun
        policy.setup()
        policy.start()
        begin = time.monotonic()
        while (not policy.rows or policy.rows[-1][0] - policy.rows[0][0] < STREAM_SAMPLES) and time.monotonic() - begin < WALL_LIMIT_S:
            time.sleep(0.02)
        seconds = time.monotonic() - begin
        policy.stop()
        time.sleep(0.2)
        overrun = read_info(x).overrun
        x.disconnect()
    rows = policy.rows
    passed = rows[-1][0] - rows[0][0] if rows else 0
    check(f"only {passed} of the board's samples passed in {WALL_LIMIT_S} s", passed >= STREAM_SAMPLES)
    check("samples are one prescaler apart", all((b[0] - a[0]) % prescaler == 0 for a, b in zip(rows, rows[1:])))
    lost = sum((b[0] - a[0]) // prescaler - 1 for a, b in zip(rows, rows[1:]))
    bad = sum(zlib.crc32(struct.pack("<2I7f2I", *row[:11])) != row[11] for row in rows)
    check(f"{lost} samples lost, the board counts {overrun}", lost == overrun - overrun_before)
    check(f"{bad} CRC failures", bad == 0)
    return len(rows), lost, len(rows) / seconds


def paced(check, board, key, image, counter, baud):
    """Seconds of a download, and samples a second that the line carries, on a line of this rate."""
    line = rig.Line(board.port, baud=baud)
    prescaler = next(p for p in range(1, 256) if 1000 / p * 48 <= baud / 10)  # 48 bytes a sample
    x = master(line.port, key, None)
    with x:
        x.connect()
        x.getCommModeInfo()
        x.cond_unlock("calpag")
        x.setCalPage(0x02, 0, wire.STAGING)
        begin = time.monotonic()
        write_image(x, wire.signed(image, key, counter))
        x.setCalPage(0x01, 0, wire.STAGING)
        seconds = time.monotonic() - begin
        x.disconnect()
    _, lost, rate = stream(check, line.port, key, prescaler)
    line.close()
    return f"{baud} bit/s: download {seconds:.2f} s, {rate:.0f} samples a second, {lost} lost"


def describe(check, path):
    """What pya2ldb finds in the A2L file."""
    from pya2l import import_a2l, model

    session = import_a2l(path, in_memory=True, loglevel="CRITICAL", progress_bar=False)
    names = {m.name: m for m in session.query(model.Measurement).all()}
    check(f"measurements {sorted(names)}", len(names) >= len(FIELDS))
    addresses = {m.ecu_address.address for m in names.values() if m.ecu_address}
    check("addresses of the live sample", {wire.LIVE + 4 * i for i in range(9)} <= addresses)
    characteristics = session.query(model.Characteristic).all()
    module = session.query(model.Module).first()
    parsed = session.parse_ifdata(list(module.if_data))
    text = str(parsed)
    check("IF_DATA of the line", "XCP_ON_SxI" in text and "HEADER_LEN_CTR_WORD" in text and "CHECKSUM_WORD" in text)
    check("IF_DATA of the protocol", "248" in text)
    return len(names), len(characteristics)


class Load:
    """A machine that has no time for the board: its process stands still for this share of every 50 ms."""

    def __init__(self, process, share):
        self.process, self.share, self.ended = process, share, threading.Event()
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def _run(self):
        while not self.ended.is_set() and self.share > 0:
            self.process.send_signal(signal.SIGSTOP)
            time.sleep(0.05 * self.share)
            self.process.send_signal(signal.SIGCONT)
            time.sleep(0.05 * (1 - self.share))

    def end(self):
        self.ended.set()
        self.thread.join()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True)
    parser.add_argument("--board", choices=("host", "stm32f405"), default="host")
    parser.add_argument("--load", type=float, default=0.0, help="share of the time for which the emulated board stands still")
    a = parser.parse_args()
    if not 0 <= a.load < 1 or (a.load > 0 and a.board == "host"):
        parser.error("--load is 0 to below 1, for an emulated board, whose time stands still with it")
    build = a.build
    if a.board != "host":
        # Of the wall's seconds: what the board does meanwhile is judged by its samples. An answer that came after the question was asked
        # again would be taken for the next one's, so it is asked again only when none can be on its way any more.
        master.patience, master.timeout_s = 8, 9.0  # pyxcp gives the nanoseconds of it to pyserial as seconds, which takes 9.2e9
    check = Checks()
    model = os.path.join(HERE, "..", "..", "data", "live", "model.yaml")
    with tempfile.TemporaryDirectory(prefix="beamfit_conformance_") as directory:
        key_path = rig.make_key(os.path.join(directory, "key"))
        key = wire.read_key(key_path)
        image_path, a2l = os.path.join(directory, "image"), os.path.join(directory, "beamfit.a2l")
        flash = os.path.join(directory, "flash")
        board = (rig.Board(build, "--key", key_path, "--nvm", flash) if a.board == "host" else
                 rig.Product(build, key_path, flash)).power_on()
        load = Load(board.process, a.load)
        try:
            link = wire.Link(board.port, timeout_s=0.3 if a.board == "host" else 3.0)
            link.connect()
            info = link.info()
            link.close()
            rig.run(f"{build}/beamfit", "export", model, "-o", image_path, "--key", key_path, "--device",
                    info.device.hex(), "--counter", info.stored + 1, "--a2l", a2l)
            with open(image_path, "rb") as file:
                image = file.read()
            seconds, transport = session(check, board.port, key, image)
            samples, lost, _ = stream(check, board.port, key)
            rates = [paced(check, board, key, image, info.stored + 2 + i, baud)
                     for i, baud in enumerate((115200, 921600) if a.board == "host" else ())]
            wrong_key(check, board.port)
        finally:
            load.end()
            board.kill()
        measurements, characteristics = describe(check, a2l)
    still = f", {a.load:.0%} of the time standing still" if a.load else ""
    print(f"conformance: pyxcp 0.29.20 on board {a.board}{still}: {check.done} checks passed; image of {len(image)} bytes "
          f"checked and running in {seconds:.2f} s; {samples} samples, {lost} lost, 0 CRC failures; pyxcp counts "
          f"{transport.frames_sent} frames sent, {transport.frames_received} received, {master.repeats} asked again, "
          f"{transport.timing.avg * 1000:.2f} ms an answer; pya2ldb 1.0.355: {measurements} measurements, "
          f"{characteristics} characteristics{''.join('; ' + rate for rate in rates)}")


if __name__ == "__main__":
    try:
        main()
    except rig.Failed as failure:
        sys.exit(str(failure))
