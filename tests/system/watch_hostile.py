# SPDX-License-Identifier: GPL-3.0-or-later
"""watch_hostile.py BEAMFIT - what `beamfit watch` answers to those who are not its page. Exit status 1 with a line for each thing that is wrong.

Needs fitted.yaml and soft.csv in the current directory.
"""
import random
import socket
import sys
import urllib.parse

from watch_browser import Watch, faults, wanted

FORM = "application/x-www-form-urlencoded"


def raw(port, data, seconds=60):
    """Everything that is answered to these bytes."""
    with socket.create_connection(("127.0.0.1", port), timeout=seconds) as line:
        answer = b""
        try:
            line.sendall(data)
            line.shutdown(socket.SHUT_WR)
            while part := line.recv(65536):
                answer += part
        except OSError:
            pass
        return answer


def status(answer):
    words = answer.split(b" ", 2)
    return int(words[1]) if len(words) > 1 and words[1].isdigit() else None


def request(port, method, path, body=b"", **headers):
    lines = {"Host": f"127.0.0.1:{port}", "Connection": "close"}
    if body or method == "POST":
        lines.update({"Content-Type": FORM, "Content-Length": str(len(body))})
    lines.update({name.replace("_", "-"): value for name, value in headers.items()})
    head = f"{method} {path} HTTP/1.1\r\n" + "".join(f"{k}: {v}\r\n" for k, v in lines.items() if v is not None) + "\r\n"
    return raw(port, head.encode() + body)


def attack(port, token):
    own = "/" + token + "/"
    expected = [
        ("the page", request(port, "GET", own), 200), ("the state", request(port, "GET", own + "state"), 200),
        ("no token", request(port, "GET", "/"), 403), ("an icon", request(port, "GET", "/favicon.ico"), 403),
        ("a wrong token", request(port, "GET", "/" + "0" * 32 + "/"), 403), ("a short token", request(port, "GET", own[:-3]), 403),
        ("a wrong token that posts", request(port, "POST", "/" + "f" * 32 + "/save", b"argument=x"), 403),
        ("a wrong token with a large body", request(port, "POST", "/" + "f" * 32 + "/save", b"x" * 3000000), None),
        ("another host", request(port, "GET", own, Host="evil.example"), 403),
        ("another host with the port", request(port, "GET", own, Host=f"evil.example:{port}"), 403),
        ("no host", request(port, "GET", own, Host=None), None), ("another origin", request(port, "POST", own + "undo", Origin="http://evil.example"), 403),
        ("a way out", request(port, "GET", own + "../../etc/passwd"), 404), ("a coded way out", request(port, "GET", own + "%2e%2e%2fetc%2fpasswd"), 404),
        ("what is not there", request(port, "GET", own + "nothing"), 404), ("a job that is not there", request(port, "POST", own + "exec", b"argument=x"), 404),
        ("a job by GET", request(port, "GET", own + "save"), 404), ("PUT", request(port, "PUT", own + "state", b"x"), 405),
        ("DELETE", request(port, "DELETE", own + "state"), 405), ("JSON", request(port, "POST", own + "save", b"{}", Content_Type="application/json"), 415),
        ("a large body", request(port, "POST", own + "save", b"argument=" + b"x" * 400000), 413),
        ("a body without argument", request(port, "POST", own + "save", b"name=x"), 400),
        ("a broken argument", request(port, "POST", own + "save", b"argument=%0"), 400),
        ("a long argument", request(port, "POST", own + "save", b"argument=" + b"x" * 5000), 400),
    ]
    for what, answer, code in expected:
        wanted(f"{what}: {answer[:80]}", status(answer) == code or (code is None and status(answer) in (400, 403, None)))
        wanted(f"{what}: its answer holds a file", b"root:x:0" not in answer)
    head = request(port, "GET", own).split(b"\r\n\r\n")[0].lower()
    for line in (b"content-security-policy: default-src 'none'", b"x-content-type-options: nosniff", b"referrer-policy: no-referrer", b"x-frame-options: deny"):
        wanted(f"no {line}", line in head)
    wanted("an open door for other pages", b"access-control-allow" not in head)


def noise(port, token):
    """Bytes at random, and requests that are changed at random: none of them may end the program."""
    draw = random.Random(5)
    good = f"POST /{token}/compare HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Type: {FORM}\r\nContent-Length: 11\r\nConnection: close\r\n\r\nargument=ab".encode()
    for i in range(150):
        data = bytearray(good) if i % 3 else bytearray(draw.randbytes(draw.randrange(1, 3000)))
        for _ in range(draw.randrange(1, 6)):
            data[draw.randrange(len(data))] = draw.randrange(256)
        raw(port, bytes(data[:draw.randrange(1, len(data) + 1)]))
    raw(port, b"GET /" + b"a" * 200000 + b" HTTP/1.1\r\n\r\n")
    raw(port, b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 50000 + b"\r\n")
    lines = [socket.create_connection(("127.0.0.1", port), timeout=60) for _ in range(20)]  # that say nothing
    wanted("silent lines keep others out", status(request(port, "GET", f"/{token}/state")) == 200)
    for line in lines:
        line.close()


def main():
    with Watch("fitted.yaml", "soft.csv") as watch, Watch("fitted.yaml", "soft.csv") as other:
        place = urllib.parse.urlsplit(watch.address)
        wanted("two tokens are alike", urllib.parse.urlsplit(other.address).path != place.path)
        attack(place.port, place.path.strip("/"))
        noise(place.port, place.path.strip("/"))
        wanted("it is gone", status(request(place.port, "GET", place.path + "state")) == 200)
        reached = True
        try:
            socket.create_connection((socket.gethostbyname(socket.gethostname()), place.port), timeout=5).close()
        except OSError:
            reached = socket.gethostbyname(socket.gethostname()).startswith("127.")
        wanted("it listens on another address than 127.0.0.1", not reached or socket.gethostbyname(socket.gethostname()).startswith("127."))
    print("\n".join(faults) if faults else "nobody but its page")
    return 1 if faults else 0


sys.exit(main())
