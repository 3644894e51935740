#!/usr/bin/env python3
"""Load of the streams of the lab streaming layer, by its own library (pip install pylsl numpy).

    bench/lsl.py PROGRAM [--seconds 600] [--rate 1000] [--on tcp|pty]

A virtual device of 8 x 8 taxels (256 channels) plays over TCP or a pseudo-terminal; `taxel live` records it and opens its streams; pylsl
takes readings, values and totals. Printed, and held: no sample is lost on any of the three, nor in the recording; the stamp of each
sample is within 1 ms of the time at which the device took it, which its truth file says by the clock of this computer.
Exit 1 where that does not hold.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time

import numpy
import pylsl

# The bound of the stamps, s.
WITHIN = 1e-3
STREAMS = "taxel readings", "taxel values", "taxel force"


class Taken(threading.Thread):
    """All samples of a stream: the stamps, and what each sample begins with."""

    def __init__(self, info):
        super().__init__(daemon=True)
        self.inlet = pylsl.StreamInlet(info, max_buflen=60)
        self.channels, self.stamps, self.first = info.channel_count(), [], []
        self.inlet.open_stream(10)
        self.correction = self.inlet.time_correction(5)
        self.end = False

    def run(self):
        buffer = numpy.zeros((1024, self.channels), numpy.float32)
        while not self.end:
            _, stamps = self.inlet.pull_chunk(timeout=0.1, max_samples=len(buffer), dest_obj=buffer)
            self.stamps += stamps
            self.first.append(buffer[: len(stamps), 0].copy())


def started(program, *arguments):
    process = subprocess.Popen([program, *arguments], stdout=subprocess.PIPE, text=True)
    return process, process.stdout.readline().strip()


def resolved(seconds=20):
    found, until = {}, time.monotonic() + seconds
    while len(found) < len(STREAMS) and time.monotonic() < until:
        found.update({info.name(): info for info in pylsl.resolve_streams(1.0) if info.name() in STREAMS})
    if len(found) < len(STREAMS):
        sys.exit(f"of the streams {STREAMS} only {sorted(found)} answer")
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="taxel")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--rate", type=float, default=1000.0, help="frames a second")
    parser.add_argument("--on", choices=["tcp", "pty"], default="tcp")
    parser.add_argument("--faults", help="faults of the virtual device, such as a clock that runs fast")
    arguments = parser.parse_args()
    folder = tempfile.TemporaryDirectory(prefix="taxel-lsl-")
    truth, recording = (os.path.join(folder.name, name) for name in ("truth.jsonl", "run.mcap"))
    array = "three-axis-8x8", "--board", "taxel-wire-1-256"
    place = "tcp:0" if arguments.on == "tcp" else "pty"
    faults = ["--faults", arguments.faults] if arguments.faults else []
    device, port = started(
        arguments.program, "device", *array, "--on", place, "--rate", f"{arguments.rate:g} Hz", "--truth", truth, *faults
    )
    source = f"serial:{port}" if arguments.on == "pty" else port if port.startswith("tcp:") else f"tcp:{port}"
    live, _ = started(arguments.program, "live", *array, "--source", source, "--out", "lsl", "--record", recording, "--port", "0")
    try:
        streams = {name: Taken(info) for name, info in resolved().items()}
        for stream in streams.values():
            stream.start()
        time.sleep(arguments.seconds)
        used = [os.popen(f"ps -o cputimes= -p {process.pid}").read().strip() for process in (device, live)]
        # The inlets are ended first: what they have is whole.
        for stream in streams.values():
            stream.end = True
            stream.join()
    finally:
        for process in (live, device):
            process.send_signal(signal.SIGINT)
            process.wait(30)
    with open(truth, encoding="utf-8") as lines:
        true = numpy.array([json.loads(line)["steady_s"] for line in lines])
    wrong = False
    for name, stream in streams.items():
        stamps = numpy.array(stream.stamps)
        # The frame of each sample is the one nearest in time; each must be the next.
        frames = numpy.rint((stamps - true[0]) * arguments.rate).astype(int)
        lost = int(frames[-1] - frames[0] + 1 - len(stamps))
        steps = numpy.diff(frames)
        error = numpy.abs(stamps - true[numpy.clip(frames, 0, len(true) - 1)])
        wrong |= lost != 0 or bool((steps != 1).any()) or error.max() > WITHIN or len(stamps) < 0.9 * arguments.seconds * arguments.rate
        print(
            f"{name}: {len(stamps)} samples of {stream.channels} channels in {stamps[-1] - stamps[0]:.2f} s, {lost} lost; "
            f"|stamp - truth| median {1e6 * numpy.median(error):.0f} us, 99.9 % {1e6 * numpy.quantile(error, 0.999):.0f} us, "
            f"largest {1e6 * error.max():.0f} us; time_correction {1e6 * stream.correction:.0f} us"
        )
    inspected = subprocess.run([arguments.program, "recording", "inspect", recording], capture_output=True, text=True)
    print(inspected.stdout)
    print(f"CPU time: device {used[0]} s, live {used[1]} s")
    sys.exit("not held" if wrong or inspected.returncode else 0)


if __name__ == "__main__":
    main()
