# SPDX-License-Identifier: GPL-3.0-or-later
"""browser.py: a headless Chromium, driven over its DevTools pipe (Chrome DevTools Protocol), for tests of the pages.

    with Browser() as browser:
        browser.open("file:///...")
        browser.value("document.title")
        browser.faults()   # console errors, exceptions, and everything that was asked of the network
"""
import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time

SECONDS = 240  # that one answer may take on a loaded machine


class Failure(Exception):
    pass


def is_there():
    return shutil.which("chromium") is not None


class Browser:
    def __init__(self, width=1280, height=900, dark=False, phone=False):
        self.profile = tempfile.TemporaryDirectory(prefix="beamfit-chromium-", ignore_cleanup_errors=True)
        to_read, self.to_browser = os.pipe()
        self.from_browser, to_write = os.pipe()
        command = ["chromium", "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-extensions",
                   "--disable-background-networking", "--disable-dev-shm-usage", "--remote-debugging-pipe",
                   f"--user-data-dir={self.profile.name}", "about:blank"]
        environment = dict(os.environ, HOME=self.profile.name)

        def pass_pipes():
            read, write = os.dup(to_read), os.dup(to_write)  # the pipe's two ends are descriptors 3 and 4
            os.dup2(read, 3)
            os.dup2(write, 4)

        self.process = subprocess.Popen(command, preexec_fn=pass_pipes, close_fds=False, env=environment, start_new_session=True,
                                        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_read)
        os.close(to_write)
        self.number, self.buffer, self.events, self.answers, self.session = 0, b"", [], {}, None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(domain + ".enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=phone)
        self.call("Emulation.setEmulatedMedia",
                  features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            self.session = None
            self.call("Browser.close")
        except (Failure, OSError):
            self.process.kill()
        self.process.wait(30)
        os.close(self.to_browser)
        os.close(self.from_browser)
        self.profile.cleanup()

    def call(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.to_browser, json.dumps(message).encode() + b"\0")
        end = time.monotonic() + SECONDS
        while self.number not in self.answers:
            self.listen(end)
        answer = self.answers.pop(self.number)
        if "error" in answer:
            raise Failure(f"{method}: {answer['error']['message']}")
        return answer["result"]

    def listen(self, end):
        """Takes what the browser says next: an answer or an event."""
        while b"\0" not in self.buffer:
            if not select.select([self.from_browser], [], [], max(0.0, end - time.monotonic()))[0]:
                raise Failure("the browser does not answer")
            part = os.read(self.from_browser, 1 << 20)
            if not part:
                raise Failure("the browser has ended")
            self.buffer += part
        text, self.buffer = self.buffer.split(b"\0", 1)
        message = json.loads(text)
        if "id" in message:
            self.answers[message["id"]] = message
        else:
            self.events.append(message)

    def open(self, address):
        self.events.clear()
        self.call("Page.navigate", url=address)
        self.until("document.readyState === 'complete'")

    def value(self, expression):
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise Failure(f"{expression}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def until(self, expression, seconds=SECONDS):
        """The expression's value as soon as it is true."""
        end = time.monotonic() + seconds
        while not (value := self.value(expression)):
            if time.monotonic() > end:
                raise Failure(f"never true: {expression}")
            time.sleep(0.05)
        return value

    def settle(self):
        """Until what was asked for has been drawn."""
        self.value("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(() => done(1), 30))))")

    def box(self, selector):
        """[x, y, width, height] of the first element of the selector, scrolled into sight."""
        self.value(f"document.querySelector({json.dumps(selector)}).scrollIntoView({{block: 'center'}})")
        self.settle()
        return self.value(f"(r => [r.x, r.y, r.width, r.height])(document.querySelector({json.dumps(selector)}).getBoundingClientRect())")

    def mouse(self, kind, x, y, held=True, clicks=1):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left" if held else "none", buttons=1 if held else 0,
                  clickCount=clicks)

    def click(self, selector, clicks=1):
        x, y, width, height = self.box(selector)
        for n in range(1, clicks + 1):
            self.mouse("mousePressed", x + width / 2, y + height / 2, clicks=n)
            self.mouse("mouseReleased", x + width / 2, y + height / 2, clicks=n)
        self.settle()

    def drag(self, selector, start, end):
        """From one share of the element's width to another, at half its height."""
        x, y, width, height = self.box(selector)
        self.mouse("mousePressed", x + start * width, y + height / 2)
        for i in range(1, 6):
            self.mouse("mouseMoved", x + (start + (end - start) * i / 5) * width, y + height / 2)
        self.mouse("mouseReleased", x + end * width, y + height / 2)
        self.settle()

    def key(self, key):
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, text=key if len(key) == 1 else "")
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key)
        self.settle()

    def screenshot(self, path, whole=True):
        if whole:
            size = self.call("Page.getLayoutMetrics")["cssContentSize"]
            clip = {"x": 0, "y": 0, "width": size["width"], "height": min(size["height"], 12000), "scale": 1}
            data = self.call("Page.captureScreenshot", captureBeyondViewport=True, clip=clip)["data"]
        else:
            data = self.call("Page.captureScreenshot")["data"]
        with open(path, "wb") as stream:
            stream.write(base64.b64decode(data))

    def print(self, path):
        with open(path, "wb") as stream:
            stream.write(base64.b64decode(self.call("Page.printToPDF", printBackground=True, paperWidth=8.27, paperHeight=11.69)["data"]))

    def faults(self, own=("file:", "data:", "about:")):
        """Errors and warnings of the console, exceptions, and requests to anywhere but `own`."""
        self.value("1")  # whatever was said before this answer is here
        found = []
        for event in self.events:
            kind, what = event["method"], event.get("params", {})
            if kind == "Runtime.exceptionThrown":
                found.append("exception: " + json.dumps(what["exceptionDetails"])[:400])
            elif kind == "Runtime.consoleAPICalled" and what["type"] in ("error", "warning", "assert"):
                found.append("console: " + json.dumps(what["args"])[:400])
            elif kind == "Log.entryAdded" and what["entry"]["level"] in ("error", "warning"):
                found.append("log: " + what["entry"]["text"][:400])
            elif kind == "Network.requestWillBeSent" and not what["request"]["url"].startswith(own):
                found.append("asked for " + what["request"]["url"][:200])
        return found
