# SPDX-License-Identifier: GPL-3.0-or-later
"""report_browser.py PAGE [PICTURES] - opens a page of `beamfit report` with a diagnosis in headless Chromium and operates every control.

Exit status 1 with a line for each thing that is wrong. PICTURES: a folder for screens of a desktop, a phone and in the dark, and the printed page.
"""
import os
import sys

from browser import Browser

faults = []


def wanted(what, true):
    if not true:
        faults.append(what)


def window(browser, selector):
    """[from, to] of the abscissa of the chart, as the page's own library has it."""
    return browser.value(f"""(() => {{ let found = null;
        Chart.each((c) => {{ if (c.host === document.querySelector('{selector}') && c.graph) found = c.graph.xAxisRange(); }});
        return found; }})()""")


def curves(browser, selector):
    """Names of the curves that the chart shows, from its legend."""
    return browser.value(f"document.querySelector('{selector} .keys').innerText")


def pixels(browser, selector):
    """What is drawn, as text."""
    return browser.value(f"[...document.querySelectorAll('{selector} canvas')].map((canvas) => canvas.toDataURL()).join()")


def zoom_and_pan(browser, first, second):
    """first and second: charts of one group."""
    browser.box(second)
    browser.box(first)
    whole = window(browser, first)
    browser.drag(first, 0.4, 0.6)
    zoomed = window(browser, first)
    wanted(f"{first}: drag does not zoom: {whole} {zoomed}", zoomed[1] - zoomed[0] < 0.5 * (whole[1] - whole[0]))
    browser.box(second)
    wanted(f"{second} does not follow {first}", window(browser, second) == zoomed)
    browser.click("#drag-pan")
    browser.drag(first, 0.6, 0.4)
    panned = window(browser, first)
    wanted(f"{first}: drag does not pan: {zoomed} {panned}",
           panned[0] > zoomed[0] and abs((panned[1] - panned[0]) - (zoomed[1] - zoomed[0])) < 1e-6 * whole[1])
    browser.click("#drag-zoom")
    browser.value(f"document.querySelector('{first}').focus()")
    browser.key("-")
    wider = window(browser, first)
    wanted(f"{first}: - does not widen", wider[1] - wider[0] > 1.5 * (panned[1] - panned[0]))
    browser.key("ArrowRight")
    wanted(f"{first}: an arrow does not move", window(browser, first)[0] > wider[0])
    browser.click("#reset")
    wanted(f"{first}: 'whole' is {window(browser, first)}, was {whole}",
           all(abs(a - b) < 1e-3 * whole[1] for a, b in zip(window(browser, first), whole)))


def toggles(browser):
    chart = "#channel0 .time"
    browser.box(chart)
    shown = browser.value(f"""(() => {{ let n = [0, 0];
        Chart.each((c) => {{ if (c.host === document.querySelector('{chart}'))
            n = ['measured', 'model'].map((name) => c.spec.curves.find((curve) => curve.name === name).y.filter((v) => v !== null).length); }});
        return n; }})()""")
    wanted(f"measured and model have {shown} points", shown[0] == shown[1] > 100)
    for name in ("measured", "model"):
        before = pixels(browser, chart)
        browser.click("#show-" + name)
        browser.box(chart)
        wanted(f"{name} does not go", name not in curves(browser, chart) and pixels(browser, chart) != before)
        browser.click("#show-" + name)
        browser.box(chart)
        wanted(f"{name} does not come back", name in curves(browser, chart))
    browser.click("#show-residual")
    wanted("residual does not go", browser.value("document.querySelector('#channel0 .time-residual').offsetHeight") == 0)
    browser.click("#show-residual")
    wanted("residual does not come back", browser.value("document.querySelector('#channel0 .time-residual').offsetHeight") > 50)
    browser.click("#show-noise")
    browser.box("#channel0 .magnitude")
    wanted("noise does not go", "noise" not in curves(browser, "#channel0 .magnitude"))
    browser.click("#show-noise")


def slide(browser, to):
    browser.value(f"(s => {{ s.value = {to}; s.dispatchEvent(new Event('input')); }})(document.querySelector('#split'))")
    browser.settle()


def slider(browser):
    chart = "#channel0 .time-residual"
    browser.box(chart)
    wanted("before is shown although the slider is at its end", "before" not in curves(browser, chart))
    after = pixels(browser, chart)
    seen = {after}
    for at in (300, 700, 1000):
        slide(browser, at)
        seen.add(pixels(browser, chart))
        wanted("before is not shown", "before" in curves(browser, chart))
    wanted("the slider does not change the picture each time", len(seen) == 4)
    slide(browser, 0)
    wanted("the slider does not come back", pixels(browser, chart) == after)


def explanations(browser):
    chart, rows = "#channel0 .time-residual", "#explanations tbody tr"
    n = browser.value(f"document.querySelectorAll('{rows}').length")
    wanted(f"{n} explanations", n >= 4)
    named = browser.value(f"document.querySelector('{rows}.after').cells[2].innerText")
    error = browser.value("document.querySelector('#channel0 .error').innerText")
    browser.box(chart)
    was = pixels(browser, chart)
    browser.click(f"{rows}:nth-child(1) td:nth-child(3)")
    browser.box(chart)
    wanted("a click on a row does not switch the curves", pixels(browser, chart) != was)
    wanted("a click on a row does not switch the error", browser.value("document.querySelector('#channel0 .error').innerText") != error)
    wanted("the row is not marked", browser.value(f"document.querySelectorAll('{rows}.after').length") == 1)
    browser.click(f"{rows}:nth-child({n}) [name=before]")
    wanted("before is not marked", browser.value(f"document.querySelector('{rows}:nth-child({n})').classList.contains('before')"))
    browser.click(f"{rows}:nth-child(1) [name=before]")
    wanted("one model against itself still has a slider", browser.value("document.querySelector('#wipe').hidden"))
    browser.click(f"{rows}:nth-child(2) [name=after]")
    wanted("two models have no slider", not browser.value("document.querySelector('#wipe').hidden"))
    return named


def no_overflow(browser, width):
    wanted(f"the page is wider than {width}", browser.value("document.documentElement.scrollWidth") <= width)


def operate(page):
    with Browser(1280, 900) as browser:
        browser.open(page)
        zoom_and_pan(browser, "#channel0 .time", "#channel0 .time-residual")
        zoom_and_pan(browser, "#channel0 .magnitude", "#channel0 .frequency-residual")
        browser.box("#channel0 .phase")
        wanted("phase and magnitude differ in frequency", window(browser, "#channel0 .phase") == window(browser, "#channel0 .magnitude"))
        browser.drag("#channel0 .phase", 0.2, 0.5)
        browser.box("#channel1 .magnitude")
        wanted("channels do not share their frequency", window(browser, "#channel1 .magnitude") == window(browser, "#channel0 .phase"))
        browser.click("#channel0 .phase .plot", clicks=2)
        toggles(browser)
        slider(browser)
        named = explanations(browser)
        wanted(f"the explanation that is shown at first is {named}", named == "tip_mass")
        no_overflow(browser, 1280)
        faults.extend(browser.faults())


def look(page, folder):
    """Screens, and the page on paper: all charts must be drawn there."""
    for name, width, height, dark, phone in (("desktop", 1280, 900, False, False), ("phone", 390, 844, False, True), ("dark", 1280, 900, True, False)):
        with Browser(width, height, dark, phone) as browser:
            browser.open(page)
            browser.box("#channel0 .frequency-residual")
            no_overflow(browser, width)
            ground = browser.value("getComputedStyle(document.body).backgroundColor").strip("rgb()").split(",")
            wanted(f"{name}: the page's ground is {ground}", (float(ground[0]) < 60) == dark)
            small = browser.value("""[...document.querySelectorAll('p, td, th, label, .dygraph-axis-label')].filter(
                (e) => e.offsetHeight && parseFloat(getComputedStyle(e).fontSize) < 11).length""")
            wanted(f"{name}: {small} texts below 11 px", small == 0)
            if folder:
                browser.screenshot(os.path.join(folder, name + ".png"))
            if name == "dark":
                browser.value("Chart.forPrint(true)")
                undrawn = browser.value("(() => { let n = 0; Chart.each((c) => { n += !c.graph; }); return n; })()")
                wanted(f"{undrawn} charts are not drawn on paper", undrawn == 0)
                wanted("paper is not white", browser.value("getComputedStyle(document.documentElement).getPropertyValue('--paper')").strip() == "#fff")
                browser.value("Chart.forPrint(false)")
                if folder:
                    browser.print(os.path.join(folder, "printed.pdf"))
            faults.extend(f"{name}: {fault}" for fault in browser.faults())


def main():
    page = "file://" + os.path.abspath(sys.argv[1])
    operate(page)
    look(page, sys.argv[2] if len(sys.argv) > 2 else None)
    print("\n".join(faults) if faults else "every control answers")
    return 1 if faults else 0


sys.exit(main())
