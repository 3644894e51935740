"""Client of `taxel live`: frames, events and status over its WebSocket. One file, standard library only.

    from taxel_live import TaxelLive

    with TaxelLive("http://127.0.0.1:7117/?token=...") as live:   # the address that `taxel live` prints
        live.tare()
        for frame in live.frames():
            print(frame.sequence, frame.force, frame.values.shape)

With NumPy, arrays are NumPy arrays; without it they are lists. The protocol is docs/live-protocol.md, version 5.
Run as a program it prints the total force of each frame: python3 taxel_live.py ADDRESS
"""

import base64
import hashlib
import json
import math
import os
import socket
import struct
import sys
import urllib.parse
from collections import deque

try:
    import numpy
except ImportError:
    numpy = None  # type: ignore[assignment, unused-ignore]

PROTOCOL = 5
MAGIC = 0x354C5854
HEADER = struct.Struct("<IHH5Q2d3d3d3d2d3dd4IQIBBH")
CONTACT = struct.Struct("<20d")
NOT_KNOWN = 2**64 - 1
NO_STATE = 255
EXACT, AT_LEAST, UNKNOWN = 0, 1, 2
# A message of the server is far smaller; more is not a taxel.
LARGEST_MESSAGE = 64 << 20
UNCHECKED_WIRE, INFERRED_TIME = 1, 2


class TaxelError(Exception):
    """The server cannot be reached, or says something that is not the protocol."""


class Contact:
    """One region of touch; SI units, positions from the centre of the array."""

    __slots__ = (
        "id", "taxels", "centre", "covariance", "velocity", "force", "force_deviation", "torsion", "peak", "peak_taxel",
        "bound", "certainty",
    )

    def __init__(self, numbers):
        self.id, self.taxels = int(numbers[0]), int(numbers[1])
        self.centre, self.covariance, self.velocity = numbers[2:4], numbers[4:7], numbers[7:9]
        self.force, self.force_deviation = numbers[9:12], numbers[12:15]
        self.torsion, self.peak, self.peak_taxel = numbers[15], numbers[16], int(numbers[17])
        # Code of the state of a taxel that gives only a bound, or None.
        self.bound = None if math.isnan(numbers[18]) else int(numbers[18])
        # How much the force says: index into `hello["certainties"]`.
        self.certainty = int(numbers[19])


class Frame:
    """One frame. SI units; NaN for what is not known.

    `readings` has one number for each channel, `values` and `deviations` one row for each taxel: of one number or of
    three (x, y, z), as `hello["components"]` says. `states` are indices into `hello["states"]`.
    """

    __slots__ = (
        "components", "sequence", "time_ns", "lost", "late", "duplicate", "rate", "latency", "force", "force_deviation",
        "moment", "centre", "centre_covariance", "sum", "tared", "tare_running", "clipped", "host_ns", "flags",
        "contacts", "readings", "values", "deviations", "residuals", "channel_states", "states", "counted",
        "total_certainty", "total_reason", "zero_known",
    )

    def __init__(self, message):
        if len(message) < HEADER.size:
            raise TaxelError(f"a frame has {len(message)} bytes, its header alone needs {HEADER.size}")
        head = HEADER.unpack_from(message)
        magic, self.components, contacts = head[:3]
        if magic != MAGIC:
            raise TaxelError(f"a frame begins with 0x{magic:08x}, not with TXL5")
        self.sequence, self.time_ns, lost, self.late, self.duplicate = head[3:8]
        # None where the wire of the board cannot tell.
        self.lost = None if lost == NOT_KNOWN else lost
        self.rate, self.latency = head[8:10]
        self.force, self.force_deviation, self.moment = head[10:13], head[13:16], head[16:19]
        self.centre, self.centre_covariance, self.sum = head[19:21], head[21:24], head[24]
        taxels, channels, flags, _left_out, host_ns, self.flags, self.total_certainty, reason, _ = head[25:]
        # State of a taxel that is the reason why the total is not exact, or None. An index, as `total_certainty` is.
        self.total_reason = None if reason == NO_STATE else reason
        # False while the values are no forces yet.
        self.zero_known = not flags & 32
        self.tared, self.tare_running, self.clipped = bool(flags & 1), bool(flags & 2), bool(flags & 4)
        # Arrival by the steady clock of the server, ns since its program began; None without a link.
        self.host_ns = None if host_ns == NOT_KNOWN else host_ns
        n = self.components
        needed = HEADER.size + CONTACT.size * contacts + 5 * channels + (8 * n + 6) * taxels
        if n not in (1, 3) or len(message) != needed:
            raise TaxelError(f"a frame has {len(message)} bytes; its counts need {needed}")
        at = HEADER.size
        self.contacts = []
        for _ in range(contacts):
            self.contacts.append(Contact(CONTACT.unpack_from(message, at)))
            at += CONTACT.size
        self.readings, at = _floats(message, at, channels)
        self.values, at = _rows(message, at, taxels, n)
        self.deviations, at = _rows(message, at, taxels, n)
        self.residuals, at = _floats(message, at, taxels)
        self.channel_states, at = _octets(message, at, channels)
        self.states, at = _octets(message, at, taxels)
        self.counted, at = _octets(message, at, taxels)


def _floats(message, at, count):
    if numpy is not None:
        return numpy.frombuffer(message, "<f4", count, at), at + 4 * count
    return list(struct.unpack_from(f"<{count}f", message, at)), at + 4 * count


def _rows(message, at, rows, columns):
    flat, at = _floats(message, at, rows * columns)
    if numpy is not None:
        return flat.reshape(rows, columns), at
    return [flat[row * columns:(row + 1) * columns] for row in range(rows)], at


def _octets(message, at, count):
    if numpy is not None:
        return numpy.frombuffer(message, "u1", count, at), at + count
    return list(message[at:at + count]), at + count


class TaxelLive:
    """A connection to `taxel live`.

    `hello` says what the numbers mean; `status`, `rest`, `tares`, `baseline` and `health` are the last messages of
    these kinds; `events` the last 1000 events, marks among them.
    """

    def __init__(self, address, timeout=5.0):
        parts = urllib.parse.urlsplit(address)
        token = urllib.parse.parse_qs(parts.query).get("token", [""])[0]
        if parts.scheme not in ("http", "ws") or not parts.hostname or not token:
            raise TaxelError(f'"{address}" is not an address that taxel live prints: http://HOST:PORT/?token=TOKEN')
        self._address = address
        self.status = self.rest = self.tares = self.baseline = self.health = None
        self.events = deque(maxlen=1000)
        self._frame = None
        self._buffer = bytearray()
        host, port = parts.hostname, parts.port or 80
        try:
            self._socket = socket.create_connection((host, port), timeout)
        except OSError as error:
            raise TaxelError(f"{host}:{port}: nobody answers ({error}); is taxel live running?") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._shake_hands(parts.netloc, parts.path.rstrip("/"), token)
        while not hasattr(self, "hello"):
            self._take(*self._message())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Ends the connection."""
        try:
            self._send(8, struct.pack("!H", 1000))
        except OSError:
            pass
        self._socket.close()

    def frames(self):
        """Frames as they come, until the server ends. A client that is too slow loses the oldest: see `status["dropped"]`."""
        while True:
            frame = self.next_frame()
            if frame is None:
                return
            yield frame

    def next_frame(self):
        """The next frame; None when the server has ended."""
        while True:
            try:
                kind, payload = self._message()
            except (EOFError, ConnectionError):
                return None
            self._take(kind, payload)
            if self._frame is not None:
                frame, self._frame = self._frame, None
                return frame

    def tare(self, force=False):
        """Takes the next frames as rest; refused while a contact is shown, except with `force`."""
        self.command({"command": "tare", "force": force})

    def clear_tare(self):
        """Returns to the rest values of the calibration."""
        self.command({"command": "clear_tare"})

    def mark(self, text):
        """Notes `text` at the newest frame: in the events, the history and the recording."""
        self.command({"command": "mark", "text": text})

    def undo_tare(self, to):
        """Returns to the rest values after entry `to` of `tares["entries"]`."""
        self.command({"command": "undo_tare", "to": to})

    def start_recording(self, name):
        """Records the run to `name`, such as "grasp.mcap", in the folder `status["records_to"]`; `status["message"]` says
        why not."""
        self.command({"command": "start_recording", "name": name})

    def stop_recording(self):
        """Ends the recording that is written."""
        self.command({"command": "stop_recording"})

    def pause(self, on=True):
        """Pauses a replay, or lets it go on; as all that follow it does nothing where `status["replay"]` is None."""
        self.command({"command": "pause", "on": on})

    def step(self):
        """Plays the next frame of a replay that is paused."""
        self.command({"command": "step"})

    def seek(self, time_s):
        """Plays a replay from this device time on, s."""
        self.command({"command": "seek", "time_ns": round(time_s * 1e9)})

    def speed(self, speed):
        """Plays a replay so many times as fast as it was recorded."""
        self.command({"command": "speed", "speed": speed})

    def loop(self, on=True):
        """Plays a replay again and again, or to its end."""
        self.command({"command": "loop", "on": on})

    def sensor(self, which):
        """A connection to another sensor of the same service: its place in `status["sensors"]`, or its name."""
        sensors = (self.status or {}).get("sensors", [])
        named = [sensor for sensor in sensors if sensor["name"] == which]
        if not named and isinstance(which, int) and 0 <= which < len(sensors):
            named = [sensors[which]]
        if len(named) != 1:
            known = ", ".join(sensor["name"] for sensor in sensors) or "none: the service has one sensor"
            raise TaxelError(f"{which!r} names {len(named)} sensors; there are: {known}")
        parts = urllib.parse.urlsplit(self._address)
        return TaxelLive(urllib.parse.urlunsplit(parts._replace(path=named[0]["path"])))

    def command(self, command):
        """Sends a command of docs/live-protocol.md."""
        self._send(1, json.dumps(command).encode())

    def _take(self, kind, payload):
        if kind == 2:
            self._frame = Frame(payload)
            return
        message = json.loads(payload)
        name = message.get("type")
        if name == "hello":
            if message.get("protocol") != PROTOCOL:
                raise TaxelError(f"the server speaks protocol {message.get('protocol')}, this client speaks {PROTOCOL}")
            self.hello = message
        elif name == "events":
            self.events.extend(message["events"])
        elif name in ("status", "rest", "tares", "baseline", "health"):
            setattr(self, name, message)

    def _shake_hands(self, host, begin, token):
        key = base64.b64encode(os.urandom(16)).decode()
        path = begin + "/ws?token=" + urllib.parse.quote(token, safe="")
        request = (
            f"GET {path} HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n"
        )
        self._socket.sendall(request.encode("ascii"))
        while b"\r\n\r\n" not in self._buffer:
            if len(self._buffer) > 1 << 16:
                raise TaxelError("the server does not answer as HTTP")
            self._fill()
        head, _, rest = bytes(self._buffer).partition(b"\r\n\r\n")
        self._buffer = bytearray(rest)
        first, *lines = head.decode("latin-1").split("\r\n")
        if " 401 " in first + " ":
            raise TaxelError("wrong token: use the address that this run of taxel live printed")
        fields = dict((name.strip().lower(), value.strip()) for name, _, value in (line.partition(":") for line in lines))
        accept = hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest()
        if " 101 " not in first + " " or fields.get("sec-websocket-accept") != base64.b64encode(accept).decode():
            raise TaxelError(f"the server does not speak WebSocket: {first}")

    def _fill(self):
        data = self._socket.recv(1 << 16)
        if not data:
            raise EOFError
        self._buffer += data

    def _exactly(self, count):
        while len(self._buffer) < count:
            self._fill()
        data = bytes(self._buffer[:count])
        del self._buffer[:count]
        return data

    def _message(self):
        """Kind (1 text, 2 binary) and bytes of the next whole message."""
        kind, whole = None, b""
        while True:
            first, second = self._exactly(2)
            length = second & 127
            if length == 126:
                length = struct.unpack("!H", self._exactly(2))[0]
            elif length == 127:
                length = struct.unpack("!Q", self._exactly(8))[0]
            if length + len(whole) > LARGEST_MESSAGE:
                raise TaxelError(f"a message of {length} bytes is none of taxel live")
            payload, code = self._exactly(length), first & 15
            if code == 8:
                raise EOFError
            if code == 9:
                self._send(10, payload)
            if code in (8, 9, 10):
                continue
            kind = code or kind
            whole += payload
            if first & 128:
                return kind, whole

    def _send(self, code, payload):
        mask = os.urandom(4)
        length = len(payload)
        if length < 126:
            head = struct.pack("!BB", 128 | code, 128 | length)
        else:
            head = struct.pack("!BBH", 128 | code, 128 | 126, length)
        masked = bytes(byte ^ mask[i & 3] for i, byte in enumerate(payload))
        self._socket.sendall(head + mask + masked)


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: taxel_live.py ADDRESS   (the address that taxel live prints)")
    try:
        with TaxelLive(sys.argv[1]) as live:
            print(f"# {live.hello['name']}: force x, y, z in N")
            for frame in live.frames():
                print(frame.sequence, *(f"{force:.6f}" for force in frame.force), flush=True)
    except TaxelError as error:
        sys.exit(f"error: {error}")
    except (KeyboardInterrupt, BrokenPipeError):
        pass


if __name__ == "__main__":
    main()
