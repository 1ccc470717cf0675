# SPDX-License-Identifier: GPL-3.0-or-later
"""watch_browser.py BEAMFIT [PICTURES] - `beamfit watch` in headless Chromium, in the current directory: from a hidden tip mass to the noise.

Needs fitted.yaml, a model that lacks the mass, soft.csv, hard.csv and check.csv. Every button is operated. Exit status 1 with a line for each thing
that is wrong, and a table of the time from each click to its answer. PICTURES: a folder for screens.
"""
import json
import os
import signal
import subprocess
import sys
import time

from browser import Browser, Failure

faults = []
answers = {}  # what was pressed: seconds to its answer, each time


def wanted(what, true):
    if not true:
        faults.append(what)


class Watch:
    """The program, until the end of the block; its address."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen([sys.argv[1], "watch", *arguments, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        if not line:
            raise Failure("watch did not begin: " + self.process.stderr.read())
        self.address = json.loads(line)["address"]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        said = self.process.communicate(timeout=200)
        wanted(f"watch ended with status {self.process.returncode}: {said}", self.process.returncode == 0)


def text(browser, selector):
    return browser.value(f"document.querySelector('{selector}').innerText")


def ready(browser):
    browser.until("document.querySelector('#stop') && document.querySelector('#stop').disabled && document.querySelector('#explanations') !== null")
    browser.settle()


def press(browser, selector, what=None):
    """Presses as a finger does and waits for the answer. what: the name under which the time is kept."""
    browser.box(selector)
    watch_for_answer(browser)
    browser.click(selector)
    browser.until("window.answered > 0 || performance.now() - window.pressed > 2000 && document.querySelector('#stop').disabled") # or refused
    ready(browser)
    keep(browser, what)


def watch_for_answer(browser):
    """The page itself notes when the next click comes and when its answer stands, so that the driver's own pauses are not counted."""
    browser.value("""(() => {
      const stop = document.querySelector('#stop'), at = () => requestAnimationFrame(() => { window.answered = performance.now(); });
      window.pressed = window.answered = 0;
      window.begun = false;
      addEventListener('click', () => { window.pressed = performance.now(); }, { capture: true, once: true });
      if (window.drawing)
        return;
      window.drawing = new MutationObserver(() => { if (window.answered > 0) at(); });
      window.drawing.observe(document.querySelector('#explore'), { childList: true, subtree: true });
      new MutationObserver(() => {
        window.begun = window.begun || !stop.disabled;
        if (window.begun && stop.disabled && window.answered === 0) at();
      }).observe(stop, { attributes: true, attributeFilter: ['disabled'] });
    })()""")


def keep(browser, what):
    seconds = browser.value("window.answered > window.pressed ? (window.answered - window.pressed) / 1000 : null")
    if what is not None and seconds is not None:
        answers.setdefault(what, []).append(seconds)


def at_once(browser, selector, what):
    """A control that asks the program for nothing: from the click to the frame that shows it. Pressed twice, so that all is as before."""
    for _ in range(2):
        answers.setdefault(what, []).append(browser.value(f"""new Promise((done) => {{ const start = performance.now();
            document.querySelector('{selector}').click();
            requestAnimationFrame(() => setTimeout(() => done((performance.now() - start) / 1000))); }})"""))


def steps(browser):
    return browser.value("[...document.querySelectorAll('#steps tbody tr')].map(r => [r.cells[0].innerText, parseFloat(r.cells[2].innerText)])")


def row_of(browser, name):
    """The selector of the row of that explanation."""
    names = browser.value("[...document.querySelectorAll('#explanations tbody tr')].map(r => r.cells[2].innerText)")
    return f"#explanations tbody tr:nth-child({names.index(name) + 1})" if name in names else None


def type_name(browser, name):
    browser.value(f"document.querySelector('#save-name').value = {json.dumps(name)}")


def find_and_add(browser, pictures):
    browser.box("#diagnose")
    watch_for_answer(browser)
    browser.click("#diagnose")
    browser.until("document.querySelector('#work.busy') !== null && document.querySelector('#doing').innerText.length > 3")
    wanted("the progress is not shown", browser.value("document.querySelector('#bar').offsetWidth > 50"))
    wanted("two jobs at once", browser.value("document.querySelector('#fit').disabled"))
    ready(browser)
    keep(browser, "Diagnose")
    wanted(f"the verdict is {text(browser, '#said')}", text(browser, "#said").startswith("Missing"))
    row = row_of(browser, "tip_mass")
    if row is None:
        faults.append("tip_mass is not among the explanations")
        return
    if pictures:
        browser.screenshot(os.path.join(pictures, "watch_diagnosed.png"))
    press(browser, row + " button.add", "Add (and fit)")
    before, after = [s[1] for s in steps(browser)]
    wanted(f"the error falls from {before} to {after} times the noise", before > 3 and after < 1.05)
    wanted(f"the verdict says {text(browser, '#verdict')}", "tip_mass leaves" in text(browser, "#verdict"))
    wanted("an explanation of another model can still be added", browser.value("document.querySelectorAll('button.add').length") == 0)
    wanted("the slider is not there", not browser.value("document.querySelector('#wipe').hidden"))


def undo_and_save(browser):
    press(browser, "#undo", "Undo")
    wanted(f"undo leaves {steps(browser)}", len(steps(browser)) == 1)
    wanted("the first model can be undone", browser.value("document.querySelector('#undo').disabled"))
    press(browser, "#diagnose", "Diagnose")
    press(browser, row_of(browser, "tip_mass") + " button.add", "Add (and fit)")
    for name, word in (("../found", "letters"), ("fitted", "choose another name"), ("/etc/passwd", "letters"), (".hidden", "letters"), ("", "letters")):
        type_name(browser, name)
        press(browser, "#save")
        wanted(f"'{name}' is answered with {text(browser, '#said')}", word in text(browser, "#said")
               and browser.value("document.querySelector('#said').className") == "warning")
    type_name(browser, "found")
    press(browser, "#save", "Save as")
    wanted(f"saving says {text(browser, '#said')}", "saved as ./found.yaml" in text(browser, "#said"))
    press(browser, "#save")
    wanted("its own file is not replaced", "saved as" in text(browser, "#said"))
    with open("found.yaml", encoding="utf-8") as stream:
        wanted("the model that was saved lacks the mass", "tip_mass" in stream.read())


def pick_and_fit(browser):
    press(browser, "#records tbody tr:nth-child(2) input[value=check]", "a record: fit, held out, off")
    channels = browser.value("[...document.querySelectorAll('section.channel h3')].map(h => h.innerText)")
    wanted(f"the record is not held out: {channels}", any("hard.csv" in c and "held out" in c for c in channels))
    press(browser, "#records tbody tr:nth-child(2) input[value=off]", "a record: fit, held out, off")
    channels = browser.value("[...document.querySelectorAll('section.channel h3')].map(h => h.innerText)")
    wanted(f"the record is still shown: {channels}", not any("hard.csv" in c for c in channels))
    press(browser, "#records tbody tr:nth-child(2) input[value=fit]", "a record: fit, held out, off")
    press(browser, "#fit", "Fit")
    wanted(f"fit says {text(browser, '#said')}, {steps(browser)}", len(steps(browser)) == 3 and steps(browser)[-1][1] < 1.05)
    press(browser, "#compare", "Compare")
    wanted(f"compare says {text(browser, '#said')}", "times the noise" in text(browser, "#said"))
    browser.click("#diagnose")
    browser.until("document.querySelector('#work.busy') !== null")
    press(browser, "#stop", "Stop (a diagnosis)")
    at_once(browser, "#show-model", "measured, model, residual, noise")
    at_once(browser, "#reset", "whole")
    at_once(browser, "#explanations tbody tr:nth-child(1) [name=before]", "an explanation's row: before, after")
    at_once(browser, "#drag-pan", "zoom, pan")


def live(address, pictures):
    with Browser(1280, 900) as browser:
        browser.open(address)
        ready(browser)
        find_and_add(browser, pictures)
        undo_and_save(browser)
        pick_and_fit(browser)
        faults.extend(browser.faults(own=(address, "data:", "about:")))
    for name, width, height, dark, phone in (("desktop", 1280, 900, False, False), ("phone", 390, 844, False, True), ("dark", 1280, 900, True, False)):
        with Browser(width, height, dark, phone) as browser:
            browser.open(address)
            ready(browser)
            wanted(f"the page is wider than {width}", browser.value("document.documentElement.scrollWidth") <= width)
            if pictures:
                browser.screenshot(os.path.join(pictures, f"watch_{name}.png"))
            faults.extend(browser.faults(own=(address, "data:", "about:")))


def main():
    pictures = sys.argv[2] if len(sys.argv) > 2 else None
    before = set(os.listdir("."))
    with Watch("fitted.yaml", "soft.csv", "hard.csv", "--check", "check.csv") as watch:
        live(watch.address, pictures)
    wanted(f"new files: {set(os.listdir('.')) - before}", set(os.listdir(".")) - before <= {"found.yaml"})
    print("click to answer, in seconds         least   most  clicks")
    for what, seconds in answers.items():
        print(f"{what:<34} {min(seconds):6.2f} {max(seconds):6.2f}  {len(seconds)}")
    print("\n".join(faults) if faults else "from the hidden mass to the noise, by clicks")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
