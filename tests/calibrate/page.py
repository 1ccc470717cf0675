# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables in Markdown and the reliability diagram as SVG."""

import os
import subprocess

import answers
import logistic
import records

SIDE, LEFT, TOP = 400, 70, 30  # of the diagram, in pixels


def head(title, command):
    tool = os.path.join(records.TOP, "tools", "results_page.sh")
    return subprocess.run([tool, "--head", title, command], capture_output=True, text=True, check=True).stdout


def table(names, rows):
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]) + "\n"


def reliability_table(bins):
    return table(("said", "entries", "mean of what was said", "right", "95 % interval"),
                 [("%.1f to %.1f" % (low, high), n, "%.3f" % mean, "%d = %.1f %%" % (good, 100 * good / n), "%.1f to %.1f %%" % (100 * a, 100 * b))
                  for low, high, n, mean, good, a, b in bins])


def diagram(bins, title):
    """Share that is right against the probability that was said; bars are 95 % intervals, areas of the dots grow with the entries."""
    x = lambda p: LEFT + SIDE * p
    y = lambda p: TOP + SIDE * (1 - p)
    most = max((n for _, _, n, *_ in bins), default=1)
    out = ['<svg xmlns="http://www.w3.org/2000/svg" width="%d" height="%d" font-family="sans-serif" font-size="13">' % (LEFT + SIDE + 30, TOP + SIDE + 60),
           '<rect width="100%" height="100%" fill="white"/>',
           '<text x="%g" y="20" text-anchor="middle">%s</text>' % (x(0.5), title)]
    for k in range(0, 11, 2):
        p = k / 10
        out.append('<path d="M%g %gV%gM%g %gH%g" stroke="#ddd" fill="none"/>' % (x(p), y(0), y(1), x(0), y(p), x(1)))
        out.append('<text x="%g" y="%g" text-anchor="middle">%.1f</text><text x="%g" y="%g" text-anchor="end">%.1f</text>'
                   % (x(p), y(0) + 18, p, x(0) - 8, y(p) + 4, p))
    out.append('<rect x="%g" y="%g" width="%d" height="%d" fill="none" stroke="black"/>' % (x(0), y(1), SIDE, SIDE))
    out.append('<path d="M%g %gL%g %g" stroke="#888" stroke-dasharray="5 4"/>' % (x(0), y(0), x(1), y(1)))
    for _, _, n, mean, good, low, high in bins:
        out.append('<path d="M%g %gV%g" stroke="#06c" stroke-width="2"/>' % (x(mean), y(low), y(high)))
        out.append('<circle cx="%g" cy="%g" r="%.1f" fill="#06c"><title>%d of %d</title></circle>' % (x(mean), y(good / n), 2.5 + 5 * (n / most) ** 0.5, good, n))
    out.append('<text x="%g" y="%g" text-anchor="middle">probability said</text>' % (x(0.5), y(0) + 42))
    out.append('<text transform="translate(%g %g) rotate(-90)" text-anchor="middle">share right</text>' % (LEFT - 42, y(0.5)))
    return "\n".join(out + ["</svg>", ""])


def outcome_table(rows):
    """Counts of the outcomes for each kind; columns that are empty are left out."""
    counts = {kind: {} for kind in answers.KINDS}
    for row in rows:
        word = answers.outcome(row)
        counts[row["kind"]][word] = counts[row["kind"]].get(word, 0) + 1
    words = [word for word in answers.WORDS if any(word in count for count in counts.values())]
    return table(["kind", "cases"] + words, [[kind, sum(count.values())] + [count.get(word, "") for word in words]
                                             for kind, count in counts.items() if count])


def brier_table(kinds, probabilities, labels):
    lines = []
    for kind in ("all",) + answers.KINDS:
        inside = [(p, y) for k, p, y in zip(kinds, probabilities, labels) if kind in ("all", k)]
        if inside:
            sure = [y for p, y in inside if p >= 0.9]
            lines.append((kind, len(inside), "%.1f %%" % (100 * sum(y for _, y in inside) / len(inside)),
                          "%.4f" % logistic.brier([p for p, _ in inside], [y for _, y in inside]),
                          "%d of %d" % (sum(sure), len(sure)) if sure else ""))
    return table(("kind", "entries", "right", "Brier score", "right of those with p ≥ 0.9"), lines)


def write(path, text):
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    records.write_text(path, text)
