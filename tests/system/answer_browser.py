# SPDX-License-Identifier: GPL-3.0-or-later
"""answer_browser.py FILE... - answers as HTML on a phone and a desktop: no page wider than its screen, no word of the console. Exit status 1 with what is wrong."""
import os
import sys

from browser import Browser


def main():
    faults = []
    for width in (390, 1280):
        with Browser(width, 900, phone=width < 600) as browser:
            for path in sys.argv[1:]:
                browser.open("file://" + os.path.abspath(path))
                if (wide := browser.value("document.documentElement.scrollWidth")) > width:
                    faults.append(f"{path} is {wide} px wide at {width}")
                faults.extend(f"{path}: {fault}" for fault in browser.faults())
    print("\n".join(faults) if faults else "every answer fits")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
