# SPDX-License-Identifier: GPL-3.0-or-later
"""Logistic regression by Newton's method with a ridge penalty, cross-validation over groups, reliability."""

import hashlib
import math

STEPS, TOLERANCE = 100, 1e-10


def sigmoid(z):
    return 1 / (1 + math.exp(-z)) if z >= 0 else math.exp(z) / (1 + math.exp(z))


def solve(matrix, right):
    """Gaussian elimination with pivoting."""
    n, a = len(right), [row[:] + [value] for row, value in zip(matrix, right)]
    for k in range(n):
        p = max(range(k, n), key=lambda i: abs(a[i][k]))
        a[k], a[p] = a[p], a[k]
        for i in range(k + 1, n):
            f = a[i][k] / a[k][k]
            for j in range(k, n + 1):
                a[i][j] -= f * a[k][j]
    x = [0.0] * n
    for k in reversed(range(n)):
        x[k] = (a[k][n] - sum(a[k][j] * x[j] for j in range(k + 1, n))) / a[k][k]
    return x


def fit(rows, labels, ridge, counts=None, start=None):
    """(intercept, weights) of raw features. counts: how many rows each stands for, 1. The penalty, ridge/2 · Σ w², is on the weights of standardised features; none on the intercept.
    start: what was believed before, as fit() returns it; the penalty is then on what is added to it, the intercept's too."""
    n, m = len(rows), len(rows[0])
    mean = [sum(row[j] for row in rows) / n for j in range(m)]
    sd = [math.sqrt(sum((row[j] - mean[j]) ** 2 for row in rows) / n) or 1.0 for j in range(m)]
    x = [[1.0] + [(row[j] - mean[j]) / sd[j] for j in range(m)] for row in rows]
    before = [logit(start, row) if start else 0.0 for row in rows]
    counts = counts or [1.0] * n
    penalty = [ridge if start else 1e-9] + [ridge] * m
    w = [0.0] * (m + 1)
    for _ in range(STEPS):
        gradient = [-p * value for p, value in zip(penalty, w)]
        hessian = [[penalty[i] if i == j else 0.0 for j in range(m + 1)] for i in range(m + 1)]
        for row, offset, label, count in zip(x, before, labels, counts):
            p = sigmoid(offset + sum(a * b for a, b in zip(w, row)))
            for i in range(m + 1):
                gradient[i] += count * (label - p) * row[i]
                scaled = count * max(p * (1 - p), 1e-12) * row[i]
                for j in range(m + 1):
                    hessian[i][j] += scaled * row[j]
        step = solve(hessian, gradient)
        longest = max(abs(value) for value in step)
        w = [a + b * min(1.0, 4 / longest) for a, b in zip(w, step)] if longest > 0 else w
        if longest < TOLERANCE:
            break
    weights = [w[j + 1] / sd[j] for j in range(m)]
    intercept = w[0] - sum(weight * middle for weight, middle in zip(weights, mean))
    return (start[0] + intercept, [a + b for a, b in zip(start[1], weights)]) if start else (intercept, weights)


def logit(model, row):
    return model[0] + sum(w * x for w, x in zip(model[1], row))


def predict(model, row):
    return sigmoid(logit(model, row))


def cross_validated(rows, labels, groups, ridge, counts, start=None, folds=10):
    """Probability of each row from a fit to the other folds; a group is never on both sides."""
    fold = [int(hashlib.sha256(group.encode()).hexdigest(), 16) % folds for group in groups]
    found = [math.nan] * len(rows)
    for k in range(folds):
        inside = [i for i in range(len(rows)) if fold[i] != k]
        if len(inside) == len(rows):
            continue
        model = fit([rows[i] for i in inside], [labels[i] for i in inside], ridge, [counts[i] for i in inside], start)
        for i in range(len(rows)):
            if fold[i] == k:
                found[i] = predict(model, rows[i])
    return found


def brier(probabilities, labels):
    return sum((p - y) ** 2 for p, y in zip(probabilities, labels)) / len(labels) if labels else math.nan


def interval(good, total):
    """95 % of a binomial share (Wilson)."""
    z, share = 1.96, good / total
    middle = (share + z * z / (2 * total)) / (1 + z * z / total)
    half = z / (1 + z * z / total) * math.sqrt(share * (1 - share) / total + z * z / (4 * total * total))
    return max(0.0, middle - half), min(1.0, middle + half)


def reliability(probabilities, labels, bins=10):
    """[(from, to, n, mean probability, right, low, high)] of the bins that hold something."""
    found = []
    for k in range(bins):
        inside = [(p, y) for p, y in zip(probabilities, labels) if min(int(p * bins), bins - 1) == k]
        if inside:
            good = sum(y for _, y in inside)
            low, high = interval(good, len(inside))
            found.append((k / bins, (k + 1) / bins, len(inside), sum(p for p, _ in inside) / len(inside), good, low, high))
    return found
