"""Holds a grip force on the twin of a sensor: reads the force from `taxel live`, and moves what presses on the virtual device.

In three terminals:
    taxel device three-axis-8x8 --board BOARD --on tcp:7000 --control tcp:7001
    taxel live three-axis-8x8 --board BOARD --source tcp:localhost:7000
    python3 hold_force.py ADDRESS localhost:7001 --force 0.2

An integral controller: each frame it sends {"move":{"force_n":[0,0,F]}} and is answered with the number of the first
frame that shows it. The round trip is from the sending of a command to the arrival of that frame here.
"""

import argparse
import json
import socket
import sys
import time

from taxel_live import TaxelError, TaxelLive


class Gripper:
    """The control port of `taxel device`."""

    def __init__(self, address):
        host, _, port = address.rpartition(":")
        self._socket = socket.create_connection((host or "localhost", int(port)), 5.0)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._answers = self._socket.makefile("r", encoding="utf-8")

    def press(self, force):
        """Presses with `force`, N, from now on; the number of the first frame that shows it."""
        self._socket.sendall(json.dumps({"move": {"force_n": [0.0, 0.0, force]}}).encode() + b"\n")
        answer = json.loads(self._answers.readline() or "{}")
        if "from_sequence" not in answer:
            raise TaxelError(f"the device did not move: {answer.get('error', 'no answer')}")
        return answer["from_sequence"]


def main():
    arguments = argparse.ArgumentParser(description="Holds a grip force on the twin.")
    arguments.add_argument("address", help="the address that taxel live prints")
    arguments.add_argument("control", help="HOST:PORT of taxel device --control")
    arguments.add_argument("--force", type=float, default=0.2, help="force to hold, N (default 0.2)")
    arguments.add_argument("--seconds", type=float, default=10.0, help="how long (default 10)")
    arguments.add_argument("--gain", type=float, default=8.0, help="of the integral, 1/s (default 8)")
    asked = arguments.parse_args()
    gripper = Gripper(asked.control)
    trips, waiting, measured = [], {}, []
    with TaxelLive(asked.address) as live:
        gripper.press(0.0)
        live.tare(force=True)
        command, last, begin = 0.0, None, None
        for frame in live.frames():
            now = time.monotonic()
            for number in [number for number in waiting if frame.sequence >= number]:
                trips.append(now - waiting.pop(number))
            if begin is None:
                # The zero is taken first.
                if frame.tared and not frame.tare_running and frame.time_ns > 0:
                    live.mark(f"hold {asked.force} N")
                    begin = now
                continue
            step = 0.0 if last is None else min(now - last, 0.1)
            last = now
            force = frame.force[2] if frame.force[2] == frame.force[2] else frame.sum
            command = min(max(command + asked.gain * (asked.force - force) * step, 0.0), 10.0 * asked.force)
            sent = time.monotonic()
            waiting[gripper.press(command)] = sent
            if now - begin > 0.5 * asked.seconds:
                measured.append(force)
            if now - begin > asked.seconds:
                break
    if not trips or not measured:
        sys.exit("error: no frame came back")
    trips.sort()
    mean = sum(measured) / len(measured)
    print(f"held {mean:.4f} N of {asked.force} N over the second half ({len(measured)} frames)")
    print(
        f"round trip, command to frame: median {1e3 * trips[len(trips) // 2]:.2f} ms, "
        f"99 % below {1e3 * trips[int(0.99 * (len(trips) - 1))]:.2f} ms, {len(trips)} commands"
    )


if __name__ == "__main__":
    try:
        main()
    except (TaxelError, OSError) as error:
        sys.exit(f"error: {error}")
    except KeyboardInterrupt:
        pass
