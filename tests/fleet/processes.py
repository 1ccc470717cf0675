# SPDX-License-Identifier: GPL-3.0-or-later
"""Which processes a run of ranks has, to be killed at random."""

import os


def session(leader):
    """All processes of a session, the leader's own children and theirs."""
    found = []
    for name in os.listdir("/proc"):
        try:
            if name.isdigit() and os.getsid(int(name)) == leader:
                found.append(int(name))
        except OSError:
            pass
    return found
