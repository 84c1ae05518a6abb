"""The two ways in which a call can fail, each with the exit code that the command line gives it."""

from __future__ import annotations


class PendulabError(Exception):
    """A failure whose text is one line for the user: what went wrong, what was found, what to do about it."""

    exit_code = 1


class JobError(PendulabError):
    """The job cannot be done on this input (an unreadable video, no pendulum in it, an empty table)."""

    exit_code = 1


class UsageError(PendulabError, ValueError):
    """The call itself is wrong (a negative mass, a misspelt key, an unknown model)."""

    exit_code = 2
