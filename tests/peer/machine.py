#!/usr/bin/env python3
"""The machine in a few lines, and how fast it is at what decides the figures beside it.

usage: machine.py        (the last three lines need a C compiler, `cc`)
"""
import ctypes
import os
import platform
import shutil
import statistics
import subprocess
import tempfile
import time

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"
PROBE = """
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
static long up(long x) { return x + 1; }
long (*volatile target)(long) = up;
long chain(long n) { uint64_t x = 1; while (n--) { x ^= x << 13; x ^= x >> 7; x ^= x << 17; } return x; }
long indirect(long n) { long x = 0; while (n--) x = target(x); return x; }
long heap(long n) { while (n--) { char *p = malloc(64 + n % 64); *(volatile char *)p = 1; free(p); } return 0; }
"""


def cpu(work, *arguments):
    """Median CPU seconds of three calls."""
    times = []
    for _ in range(3):
        begin = time.process_time()
        work(*arguments)
        times.append(time.process_time() - begin)
    return statistics.median(times)


def turns(n):
    total = 0
    for i in range(n):
        total += i * i & 7
    return total


def first(path, key=""):
    """The first line of a file that starts with `key`, without it."""
    try:
        with open(path) as lines:
            return next(line for line in lines if line.startswith(key)).split(":", 1)[-1].strip()
    except (OSError, StopIteration):
        return "unknown"


if __name__ == "__main__":
    print("cpu                     ", first("/proc/cpuinfo", "model name"))
    print("cores seen, load        ", os.cpu_count(), "%.1f" % os.getloadavg()[0])
    print("kernel, python          ", platform.release(), platform.python_version())
    print("indirect branches       ", first("/sys/devices/system/cpu/vulnerabilities/spectre_v2"))
    print("python loop             ", "%.0f ns per turn" % (cpu(turns, 1_000_000) * 1e3))
    import numpy
    square = numpy.ones((1024, 1024))
    print("matrix product          ", "%.1f Gflop/s" % (2 * 1.024 ** 3 / cpu(square.dot, square)))
    if shutil.which("cc"):
        with tempfile.TemporaryDirectory() as folder:
            source, library = os.path.join(folder, "probe.c"), os.path.join(folder, "probe.so")
            with open(source, "w") as out:
                out.write(PROBE)
            subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", library, source], check=True)
            probe = ctypes.CDLL(library)
            for name, label in (("chain", "six dependent operations"), ("indirect", "indirect call           "),
                                ("heap", "malloc and free         ")):
                work = getattr(probe, name)
                work.argtypes, work.restype = [ctypes.c_long], ctypes.c_long
                print(label, "%.1f ns" % (cpu(work, 10_000_000) * 1e2))
