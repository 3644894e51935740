"""Helper for programs that taxel reads with --source exec:"...": readings out, one line of JSON each.

    from taxel_source import Source

    source = Source()                       # writes to the standard output
    while True:
        values = read_my_card()             # a list of numbers, in the unit that the board file says
        source.send(values)                 # or send(values, time_s=card_time)

Each line is {"t":seconds,"n":number,"v":[...]}. Whatever else the program has to say goes to the standard error:
taxel passes it on with the name of the program in front. When taxel ends, `send` ends the program quietly.
"""

import json
import math
import os
import signal
import sys
import time


class Source:
    """Writes readings for taxel."""

    def __init__(self, output=None):
        self._output = output if output is not None else sys.stdout.buffer
        self._number = 0
        self._start = time.monotonic()
        # taxel asks with SIGTERM, and kills after two seconds.
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))

    def send(self, values, time_s=None, number=None):
        """Sends one reading of all channels. `time_s`: time of the device, s; without it the time since the start.
        `number`: running number of the device, so that losses show; without it one more than the last."""
        if time_s is None:
            time_s = time.monotonic() - self._start
        if number is not None:
            self._number = int(number)
        numbers = [float(value) for value in values]
        numbers = [value if math.isfinite(value) else None for value in numbers]
        line = json.dumps({"t": round(float(time_s), 9), "n": self._number, "v": numbers}, separators=(",", ":"))
        self._number += 1
        try:
            self._output.write(line.encode() + b"\n")
            self._output.flush()
        except BrokenPipeError:
            # Nobody reads any more.
            os._exit(0)


def say(text):
    """Tells the operator something."""
    print(text, file=sys.stderr, flush=True)


def main():
    """An example: as many slow sines as asked for, at 100 readings a second."""
    channels = int(sys.argv[1]) if len(sys.argv) > 1 else 4
    source, period = Source(), 0.01
    begin = time.monotonic()
    for number in range(1 << 62):
        now = begin + number * period
        time.sleep(max(0.0, now - time.monotonic()))
        phase = number * period
        source.send([100 + 10 * math.sin(phase + channel) for channel in range(channels)], phase, number)


if __name__ == "__main__":
    main()
