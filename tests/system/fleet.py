# SPDX-License-Identifier: GPL-3.0-or-later
"""fleet.py CHECK — one check of `beamfit fleet` in the current directory (test_fleet.c). BEAMFIT: the program; TOP: the sources."""

import hashlib
import json
import os
import random
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time

BEAMFIT = os.environ["BEAMFIT"]
BUILD = os.path.dirname(BEAMFIT)
TOP = os.environ["TOP"]
sys.path.insert(0, os.path.join(TOP, "tests/fleet"))
from processes import session  # noqa: E402

TIMES = "runs"  # the only table that differs from run to run


def draw(directory, *words):
    subprocess.run([sys.executable, "-B", os.path.join(TOP, "tests/fleet/draw.py"), directory, "--build", BUILD, "--duration",
                    "1", *words], check=True)


def run(*words, status=0, **options):
    done = subprocess.run([BEAMFIT, *words], capture_output=True, text=True, check=False, **options)
    assert done.returncode == status, "%s: status %d\n%s%s" % (words, done.returncode, done.stdout, done.stderr)
    return done


def fleet(*words, status=0):
    return run("fleet", "units.csv", *words, status=status)


def ask(path, sql, *values):
    with sqlite3.connect("file:%s?mode=ro" % path, uri=True) as db:
        return db.execute(sql, values).fetchall()


def dump(path):
    """All rows of all tables but the times, with every bit of every number."""
    names = [row[0] for row in ask(path, "SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name")]
    exact = {float: float.hex}
    return {name: sorted(repr([exact.get(type(v), repr)(v) for v in row]) for row in ask(path, "SELECT * FROM " + name))
            for name in names if name != TIMES}


def same(a, b):
    a, b = dump(a), dump(b)
    assert a.keys() == b.keys(), (a.keys(), b.keys())
    for name, rows in a.items():
        assert rows == b[name], "%s differs: %s" % (name, [row for row in zip(rows, b[name]) if row[0] != row[1]][:2])


def states(path):
    return dict(ask(path, "SELECT unit, status FROM units"))


def rows_are_those_of_fit():
    draw(".", "--units", "2")
    fleet("-o", "r.sqlite")
    for unit in ("u0001", "u0002"):
        files = ["records/%s-%s.csv" % (unit, kind) for kind in ("soft", "hard", "check")]
        answer = json.loads(run("fit", "model.yaml", *files[:2], "--check", files[2], "-o", unit + ".yaml", "--json").stdout)
        rows = {name: values for name, *values in ask(
            "r.sqlite", "SELECT name, value, sd, ci95_low, ci95_high FROM parameters WHERE unit = ? AND estimated", unit)}
        assert len(rows) == 6, rows
        for name, values in rows.items():
            said = answer["parameters"][name]
            assert values == [said["value"], said["sd"], *said["ci95"]], (name, values, said)
        assert ask("r.sqlite", "SELECT nrmse, noise_ratio FROM units WHERE unit = ?", unit) == [
            (answer["nrmse"], answer["noise_ratio"])]
        held_out = ask("r.sqlite", "SELECT nrmse FROM errors WHERE unit = ? AND held_out ORDER BY rowid", unit)
        assert len(held_out) == 2 and all(0 < row[0] < 0.1 for row in held_out), held_out
        for name, sd in ask("r.sqlite", "SELECT name, sd / value FROM parameters WHERE unit = ? AND sd AND logarithmic", unit):
            (variance,), = ask("r.sqlite", "SELECT covariance FROM covariances WHERE unit = ? AND a = ? AND b = ?", unit, name, name)
            assert abs(variance - sd * sd) < 1e-9 * variance, (name, variance, sd)
        sums = subprocess.run(["sha256sum", "model.yaml", *files], capture_output=True, text=True, check=True).stdout.split()[::2]
        assert [row[0] for row in ask("r.sqlite", "SELECT sha256 FROM inputs WHERE unit = ? ORDER BY rowid", unit)] == sums


def rows_are_those_of_diagnose():
    draw(".", "--units", "2", "--hidden", "1", "--records", "2")
    fleet("-o", "r.sqlite", "--diagnose")
    with open("truth.json", encoding="utf-8") as stream:
        hidden = {unit["unit"]: unit["hidden"] for unit in json.load(stream)["units"]}
    for unit, effect in hidden.items():
        files = ["records/%s-%s.csv" % (unit, kind) for kind in ("soft", "hard")]
        answer = json.loads(run("diagnose", "model.yaml", *files, "--threads", "1", "--json").stdout)
        (verdict, probability, text), = ask("r.sqlite", "SELECT verdict, probability, text FROM verdicts WHERE unit = ?", unit)
        assert (verdict, probability, text) == (answer["verdict"], answer["probability"], answer["text"]), (verdict, answer)
        assert (verdict == "complete") == (effect is None), (unit, verdict, effect)
        if effect:
            name, value = effect.split()[0], float(effect.split("=")[1])
            (found, sd), = ask("r.sqlite", "SELECT value, sd FROM effects WHERE unit = ? AND effect = ?", unit, name)
            assert abs(found - value) < max(5 * sd, 0.05 * value), (found, sd, value)


def processes_make_no_difference():
    draw(".", "--units", "6", "--broken", "1")
    fleet("-o", "one.sqlite", "--processes", "1")
    fleet("-o", "three.sqlite", "--processes", "3")
    same("one.sqlite", "three.sqlite")
    before = dump("one.sqlite")
    assert "0 fitted" in fleet("-o", "one.sqlite").stdout
    assert dump("one.sqlite") == before


def wait_for(what, seconds=120):
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "nothing came in %d s" % seconds
        time.sleep(0.01)


def n_done(path):
    try:
        return len(states(path)) if os.path.exists(path) else 0
    except sqlite3.OperationalError:  # being written
        return 0


def a_killed_run_goes_on():
    draw(".", "--units", "8")
    fleet("-o", "whole.sqlite")
    starts = 0
    made = "SELECT name FROM sqlite_master WHERE name = 'units'"  # the file is there before its tables
    while not os.path.exists("r.sqlite") or not ask("r.sqlite", made) or len(states("r.sqlite")) < 8:
        with subprocess.Popen([BEAMFIT, "fleet", "units.csv", "-o", "r.sqlite", "--processes", "2"], stdout=subprocess.DEVNULL,
                              start_new_session=True) as child:
            time.sleep((0.2 + 0.05 * (starts % 9)) * (1 + starts // 20))  # a slow program needs more to finish a unit
            child.kill()
            child.wait()
        with sqlite3.connect("r.sqlite") as db:  # a writer undoes what is half there
            kept = len(db.execute("SELECT unit FROM units").fetchall()) if has_tables(db) else 0
        starts += 1
        assert starts < 200, "%d units after %d starts" % (kept, starts)
    assert set(states("r.sqlite").values()) == {"done"}
    fleet("-o", "r.sqlite")
    same("whole.sqlite", "r.sqlite")


def what_came(terminal):
    """All bytes so far; none where a slow program was killed before it said anything."""
    os.set_blocking(terminal, False)
    try:
        return os.read(terminal, 1 << 20)
    except BlockingIOError:
        return b""


def what_was_said_is_there():
    """Units that end together are one transaction; the count on the terminal is of those that are on the disk."""
    with open("units.csv", "w", encoding="utf-8") as stream:
        stream.write("unit,model,records\n" + "".join("e%d,none.yaml,none.csv\n" % k for k in range(3000)))
    most = 0
    for seconds in (0.6, 1.5, 3.0):
        ours, theirs = os.openpty()
        with subprocess.Popen([BEAMFIT, "fleet", "units.csv", "-o", "r.sqlite"], stdout=subprocess.DEVNULL, stderr=theirs) as child:
            time.sleep(seconds)
            child.kill()
            child.wait()
        said = [int(n) for n in re.findall(rb"; (\d+) of 3000", what_came(ours))]
        os.close(theirs), os.close(ours)
        with sqlite3.connect("r.sqlite") as db:
            there = len(db.execute("SELECT unit FROM units").fetchall()) if has_tables(db) else 0
        assert not said or there >= said[-1], (there, said[-1])
        most = max([most, *said])
    assert most > 0, "nothing was said before the run was killed"


def has_tables(db):
    return bool(db.execute("SELECT name FROM sqlite_master WHERE name = 'units'").fetchall())


def children(parent):
    found = []
    for name in os.listdir("/proc"):
        if name.isdigit():
            try:
                with open("/proc/%s/stat" % name, encoding="utf-8") as stream:
                    if int(stream.read().rsplit(")", 1)[1].split()[1]) == parent:
                        found.append(int(name))
            except (OSError, IndexError):
                pass
    return found


def run_and_kill_a_unit(path):
    """One process; the first unit's process that is seen is killed."""
    with subprocess.Popen([BEAMFIT, "fleet", "units.csv", "-o", path, "--processes", "1"], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True) as child:
        wait_for(lambda: children(child.pid))
        for pid in children(child.pid)[:1]:
            try:
                os.kill(pid, signal.SIGKILL)
            except OSError:
                pass
        said, warned = child.communicate()
    assert child.returncode == 0, said + warned
    return said, warned


def a_killed_unit_is_a_row():
    draw(".", "--units", "3")
    fleet("-o", "whole.sqlite")
    said = run_and_kill_a_unit("r.sqlite")[0]
    ended = ask("r.sqlite", "SELECT unit, reason FROM units WHERE status = 'killed'")
    assert len(ended) == 1 and "signal 9" in ended[0][1] and ended[0][0] in said, (ended, said)
    assert "1 fitted" in fleet("-o", "r.sqlite").stdout
    same("whole.sqlite", "r.sqlite")


def a_killed_unit_keeps_what_was_known():
    draw(".", "--units", "2")
    fleet("-o", "whole.sqlite")
    shutil.copyfile("whole.sqlite", "r.sqlite")
    with open("model.yaml", encoding="utf-8") as stream:
        text = stream.read()
    with open("model.yaml", "w", encoding="utf-8") as stream:
        stream.write("# changed\n" + text)
    for _ in range(20):  # the process may be done before it is killed
        warned = run_and_kill_a_unit("r.sqlite")[1]
        assert set(states("r.sqlite").values()) == {"done"}, states("r.sqlite")
        if "what was known of it is kept" in warned:
            break
        shutil.copyfile("whole.sqlite", "r.sqlite")
    else:
        raise AssertionError("no unit could be killed")
    assert "1 fitted" in fleet("-o", "r.sqlite").stdout and "0 fitted" in fleet("-o", "r.sqlite").stdout


def mpirun(ranks, *words):
    """The command of a run on so many ranks; skips the test where there is no MPI."""
    program = os.path.join(BUILD, "beamfit-fleet")
    if not os.path.exists(program) or not shutil.which("mpirun"):
        print("SKIPPED: no MPI (apt-get install openmpi-bin libopenmpi-dev)")
        sys.exit(77)
    os.environ.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    # Open MPI's own plugins keep memory to the end; leaks of the program are looked for where it runs without MPI
    asan = ":".join(filter(None, [os.environ.get("ASAN_OPTIONS"), "detect_leaks=0"]))
    return ["mpirun", "--oversubscribe", "-x", "ASAN_OPTIONS=" + asan, "-n", str(ranks), program, *words]


def mpi(ranks, *words):
    return mpirun(ranks, "units.csv", *words)


def ranks_make_no_difference():
    mpi(1)
    draw(".", "--units", "6", "--broken", "1")
    fleet("-o", "local.sqlite")
    for ranks in (1, 2, 4):
        path = "ranks%d.sqlite" % ranks
        said = subprocess.run(mpi(ranks, "-o", path), capture_output=True, text=True, check=False)
        assert said.returncode == 0 and "6 fitted" in said.stdout, (said.stdout, said.stderr)
        same("local.sqlite", path)
    said = subprocess.run(mpi(2, "-o", "local.sqlite", "--json"), capture_output=True, text=True, check=True).stdout
    assert json.loads(said)["unchanged"] == 6, said
    done = subprocess.run(mpi(2, "-o", "units.csv"), capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stderr.count("has not made it") == 1, done.stderr


def killed_ranks_lose_nothing():
    mpi(1)
    draw(".", "--units", "10")
    fleet("-o", "whole.sqlite")
    dice, kills, kept = random.Random(int(os.environ.get("SEED", "1"))), 0, {}
    while len(kept) < 10:
        with subprocess.Popen(mpi(3, "-o", "r.sqlite"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              start_new_session=True) as child:
            time.sleep(dice.uniform(0.4, 1.6))
            alive = session(child.pid)
            if alive and child.poll() is None:
                os.kill(dice.choice(alive), signal.SIGKILL)  # mpirun, a rank, or a unit's process
            kills += 1
            child.wait()
        wait_for(lambda leader=child.pid: not session(leader))
        with sqlite3.connect("r.sqlite") as db:
            rows = db.execute("SELECT unit, identity FROM units WHERE status = 'done'").fetchall() if has_tables(db) else []
        assert set(kept.items()) <= set(rows), "a unit that was done is lost"
        kept = dict(rows)
        assert kills < 200, "%d units after %d kills" % (len(kept), kills)
    subprocess.run(mpi(2, "-o", "r.sqlite"), stdout=subprocess.DEVNULL, check=True)
    same("whole.sqlite", "r.sqlite")
    print("%d kills, rows equal" % kills)


def what_has_changed_is_fitted_again():
    draw(".", "--units", "3")
    fleet("-o", "r.sqlite")
    with open("records/u0002-soft.csv", encoding="utf-8") as stream:
        lines = stream.read().splitlines()
    with open("records/u0002-soft.csv", "w", encoding="utf-8") as stream:
        stream.write("\n".join(lines[:-10]) + "\n")
    before = dump("r.sqlite")["parameters"]
    answer = json.loads(fleet("-o", "r.sqlite", "--json").stdout)
    assert (answer["fitted"], answer["again"], answer["unchanged"]) == (1, 1, 2), answer
    after = dump("r.sqlite")["parameters"]
    changed = [row for row in after if row not in before]
    assert changed and all("u0002" in row for row in changed), changed
    assert "3 of them again" in fleet("-o", "r.sqlite", "--start", "near").stdout


def broken_inputs_are_rows():
    draw(".", "--units", "8", "--broken", "6")
    said = fleet("-o", "r.sqlite").stdout
    with open("truth.json", encoding="utf-8") as stream:
        broken = {unit["unit"]: unit["broken"] for unit in json.load(stream)["units"]}
    for unit, status, reason in ask("r.sqlite", "SELECT unit, status, reason FROM units"):
        assert (status == "failed") == (broken[unit] is not None), (unit, status, broken[unit])
        assert status == "done" or (len(reason) > 20 and unit + ":" in said), reason
    lost = next(unit for unit, kind in broken.items() if kind == "no record")
    os.link("records/%s-soft.csv" % lost, "records/%s-soft-lost.csv" % lost)
    assert json.loads(fleet("-o", "r.sqlite", "--json").stdout)["fitted"] == 1
    assert states("r.sqlite")[lost] == "done"


def what_is_not_its_own_is_refused():
    draw(".", "--units", "2", "--records", "1")
    with open("mine.txt", "w", encoding="utf-8") as stream:
        stream.write("my notes\n" * 200)
    assert "has not made it" in fleet("-o", "mine.txt", status=2).stderr
    with sqlite3.connect("other.sqlite") as db:
        db.execute("CREATE TABLE mine (a)")
    assert "has not made it" in fleet("-o", "other.sqlite", status=2).stderr
    assert "has not made it" in fleet("-o", "units.csv", status=2).stderr
    with open("r.sqlite", "w", encoding="utf-8"):
        pass  # as a run leaves it that was killed at its very beginning
    fleet("-o", "r.sqlite")
    with open("units.csv", encoding="utf-8") as stream:
        lines = stream.read().splitlines()
    for text, words in (("\n".join(lines[:-1]), "u0002"), ("unit,model\nu1,model.yaml", "records"), (lines[0], "no unit"),
                        ("\n".join([*lines, lines[1]]), "u0001"), ("\n".join([*lines, "x,y"]), "2 cells where the header has 6"),
                        ('unit,model,records\n"a,b,c', "quote")):
        with open("units.csv", "w", encoding="utf-8") as stream:
            stream.write(text + "\n")
        done = subprocess.run([BEAMFIT, "fleet", "units.csv", "-o", "r.sqlite"], capture_output=True, text=True, check=False)
        assert done.returncode in (2, 3) and words in done.stderr, (text, done.stderr)
    assert len(states("r.sqlite")) == 2
    with sqlite3.connect("r.sqlite") as db:
        db.execute("BEGIN EXCLUSIVE")
        with open("units.csv", "w", encoding="utf-8") as stream:
            stream.write("\n".join(lines) + "\n")
        assert "another run" in fleet("-o", "r.sqlite", status=3).stderr


def start_board(number, key):
    """board_host with an identity, a store and a port of its own: port<number>."""
    words = ["--key", key, "--nvm", "nvm%d" % number, "--pty-link", "port%d" % number, "--device", "%024x" % number]
    board = subprocess.Popen([os.path.join(BUILD, "board_host"), *words], stdout=subprocess.DEVNULL)  # pylint: disable=R1732
    wait_for(lambda: os.path.exists("port%d" % number))
    return board


def boards_take_their_own_models():
    draw(".", "--units", "4", "--records", "1", "--board")
    for name, last in (("key", b"\0"), ("other_key", b"x")):
        with open(os.open(name, os.O_CREAT | os.O_WRONLY, 0o600), "wb") as stream:
            stream.write(b"beamfit test key, 32 bytes long" + last)
    with open("units.csv", encoding="utf-8") as stream:
        lines = stream.read().splitlines()
    cells = ["device,counter"] + ["%024x,%d" % (k, 5 + k) for k in (1, 2, 3)] + [","]
    with open("units.csv", "w", encoding="utf-8") as stream:
        stream.write("\n".join("%s,%s" % both for both in zip(lines, cells)) + "\n")
    fleet("-o", "r.sqlite")
    rows = {row["unit"]: row for row in json.loads(run("fleet", "export", "r.sqlite", "-o", "images", "--key", "key", "--json",
                                                       status=1).stdout)["boards"]}
    assert [rows["u000%d" % k]["status"] for k in (1, 2, 3, 4)] == ["signed"] * 3 + ["refused"], rows
    assert sorted(os.listdir("images")) == ["u0001.img", "u0002.img", "u0003.img"] and "device" in rows["u0004"]["reason"]
    run("verify", "images/u0002.img", "--key", "key", "--device", "%024x" % 2, "--stored", "6")
    run("verify", "images/u0002.img", "--key", "other_key", "--device", "%024x" % 2, "--stored", "6", status=1)
    boards = [start_board(1, "key"), start_board(2, "key"), start_board(3, "other_key")]
    try:
        with open("ports.csv", "w", encoding="utf-8") as stream:
            stream.write("unit,port\nu0001,port1\nu0002,port2\nu0003,port3\nu0004,port9\nlost,port8\n")
        rows = {row["unit"]: row for row in json.loads(run("fleet", "download", "r.sqlite", "ports.csv", "--key", "key", "--json",
                                                           status=1).stdout)["boards"]}
        assert {unit: row["status"] for unit, row in rows.items()} == {
            "u0001": "runs", "u0002": "runs", "u0003": "refused", "u0004": "refused", "lost": "refused"}, rows
        assert "key" in rows["u0003"]["reason"] and "no fitted model" in rows["lost"]["reason"], rows
        for number in (1, 2):
            said = json.loads(run("info", "--port", "port%d" % number, "--json").stdout)
            (text,), = ask("r.sqlite", "SELECT text FROM models WHERE unit = ? AND stage = 'fit'", "u000%d" % number)
            assert rows["u000%d" % number]["device"] == said["device"] == "%024x" % number, said
            assert hashlib.sha256(text.encode()).hexdigest() in json.dumps(said), said
        with open("ports.csv", "w", encoding="utf-8") as stream:
            stream.write("unit,port,key\nu0003,port3,other_key\n")
        assert "u0003: port3, runs" in run("fleet", "download", "r.sqlite", "ports.csv").stdout
        with open("ports.csv", "w", encoding="utf-8") as stream:
            stream.write("unit,port\nu1,port1\nu2,port1\n")
        assert "ports.csv:3" in run("fleet", "download", "r.sqlite", "ports.csv", "--key", "key", status=3).stderr
    finally:
        for board in boards:
            board.terminate()
            board.wait()


if __name__ == "__main__":
    globals()[sys.argv[1]]()
