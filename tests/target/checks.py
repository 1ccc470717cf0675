# SPDX-License-Identifier: GPL-3.0-or-later
"""What a test on an emulated board says when it fails."""


class Failure(Exception):
    pass


def check(good, text):
    if not good:
        raise Failure(text)
