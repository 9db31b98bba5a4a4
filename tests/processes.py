"""Processes that tests start, and whether they are still there."""

import subprocess
from contextlib import contextmanager

import psutil


def is_alive(pid):
    """Whether a process runs; one that ended and was not waited for does not."""
    try:
        return psutil.Process(int(pid)).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


@contextmanager
def processes():
    """Start processes with pipes; none of them, and no pipe, is left behind.

    The warnings of those would fail whichever test runs when they are collected as
    garbage.
    """
    started = []

    def start(line, **options):
        process = subprocess.Popen(
            list(map(str, line)),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            **options,
        )
        started.append(process)
        return process

    try:
        yield start
    finally:
        for process in started:
            process.kill()
            for pipe in (process.stdout, process.stderr):
                pipe.close()
            process.wait()
