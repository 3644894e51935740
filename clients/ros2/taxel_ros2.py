"""Bridge from `taxel live` to ROS 2.

    taxel_ros2.py ADDRESS [--frame taxel] [--once N]

Publishes, with the time at which a frame came here as stamp:

    /taxel/wrench    geometry_msgs/WrenchStamped   total on the sensor, right-handed: what presses is negative along z
    /taxel/image     sensor_msgs/Image             values of the taxels, 32FC1 (pressing) or 32FC3 (x, y, pressing), SI
    /taxel/contacts  sensor_msgs/PointCloud2       contacts: x, y, z, force, deviation of its pressing part, number
    /taxel/readings  std_msgs/Float32MultiArray    readings of all channels, SI
    /taxel/frame     taxel_msgs/Frame              the same with number, times and flags, where the package taxel_msgs is built

The standard types have no place to say that a number is a bound: a total that is not exact, and the value of a taxel at an end of what can be
read, are NaN.

By `rclpy` where a ROS 2 is sourced; otherwise by `cyclonedds` (pip install cyclonedds), under the names that ROS 2 gives to topics and
types, so that nodes on the same network and domain (ROS_DOMAIN_ID) see them.
"""

import argparse
import dataclasses
import importlib
import os
import pathlib
import struct
import sys
import time
from dataclasses import dataclass

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "python"))
from taxel_live import NOT_KNOWN, TaxelError, TaxelLive  # noqa: E402


# States in which a value is no more than a bound.
BOUNDS = "closed", "out_of_range", "saturated"


# Topics, with package and type, in the order in which they are published.
TOPICS = (
    ("/taxel/wrench", "geometry_msgs", "WrenchStamped"),
    ("/taxel/image", "sensor_msgs", "Image"),
    ("/taxel/contacts", "sensor_msgs", "PointCloud2"),
    ("/taxel/readings", "std_msgs", "Float32MultiArray"),
    ("/taxel/frame", "taxel_msgs", "Frame"),
)
# Numbers of a contact, as a recording for ROS 2 has them.
FIELDS = "x", "y", "z", "force_x", "force_y", "force_z", "force_z_deviation", "id"
# Code of numbers of 32 bits with a point.
FLOAT32 = 7


class ByRclpy:
    """Publishes with the libraries of a ROS 2 installation."""

    def __init__(self):
        import rclpy

        rclpy.init()
        self._node = rclpy.create_node("taxel")
        self._publishers, self._types = {}, {}
        for name, package, kind in TOPICS:
            try:
                # The folder of the package beside this file is found as well, without what is built of it.
                self._types[kind] = getattr(importlib.import_module(package + ".msg"), kind)
            except (ImportError, AttributeError):
                if package != "taxel_msgs":
                    raise
                print("note: the package taxel_msgs is not built: /taxel/frame is left out", file=sys.stderr)
                continue
            self._publishers[name] = self._node.create_publisher(self._types[kind], name, 10)
        self._field = importlib.import_module("sensor_msgs.msg").PointField

    def make(self, kind, **fields):
        """A message whose fields, which may be those of a part (`header__stamp__sec`), are set."""
        message = self._field() if kind == "PointField" else self._types[kind]()
        for path, value in fields.items():
            *parts, last = path.split("__")
            part = message
            for name in parts:
                part = getattr(part, name)
            setattr(part, last, value)
        return message

    def has(self, name):
        return name in self._publishers

    def publish(self, name, message):
        self._publishers[name].publish(message)


class ByCyclone:
    """Publishes by DDS alone."""

    def __init__(self):
        from cyclonedds.core import Policy, Qos
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.pub import DataWriter
        from cyclonedds.topic import Topic
        from cyclonedds.util import duration

        self._kinds = kinds()
        participant = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID", "0")))
        qos = Qos(Policy.Reliability.Reliable(duration(milliseconds=100)), Policy.History.KeepLast(10))
        self._writers = {
            name: DataWriter(participant, Topic(participant, "rt" + name, self._kinds[kind]), qos=qos) for name, _, kind in TOPICS
        }

    def make(self, kind, **fields):
        """A message of these fields, which may be those of a part (`header__stamp__sec`)."""
        whole = {}
        for path, value in fields.items():
            *parts, last = path.split("__")
            part = whole
            for name in parts:
                part = part.setdefault(name, {})
            part[last] = value
        return self._built(self._kinds[kind], whole)

    def _built(self, kind, fields):
        """An instance of a type; what is not given is as empty as ROS has it."""
        values = {}
        for field in dataclasses.fields(kind):
            value, types = fields.get(field.name), {one.__name__: one for one in self._kinds.values()}
            name = getattr(field.type, "__name__", "")
            if name in types:
                value = self._built(types[name], value or {})
            elif value is None:
                value = [] if "sequence" in str(field.type) else "" if field.type is str else 0
            values[field.name] = value
        return kind(**values)

    def has(self, _):
        return True

    def publish(self, name, message):
        self._writers[name].write(message)


def kinds():
    """The types of ROS 2 as cyclonedds takes them, by name."""
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl.types import float32, float64, int32, uint8, uint32, uint64
    from cyclonedds.idl.types import sequence as many

    @dataclass
    class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
        sec: int32
        nanosec: uint32

    @dataclass
    class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
        stamp: Time
        frame_id: str

    @dataclass
    class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
        x: float64
        y: float64
        z: float64

    @dataclass
    class Wrench(IdlStruct, typename="geometry_msgs::msg::dds_::Wrench_"):
        force: Vector3
        torque: Vector3

    @dataclass
    class WrenchStamped(IdlStruct, typename="geometry_msgs::msg::dds_::WrenchStamped_"):
        header: Header
        wrench: Wrench

    @dataclass
    class Image(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
        header: Header
        height: uint32
        width: uint32
        encoding: str
        is_bigendian: uint8
        step: uint32
        data: many[uint8]

    @dataclass
    class MultiArrayDimension(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayDimension_"):
        label: str
        size: uint32
        stride: uint32

    @dataclass
    class MultiArrayLayout(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayLayout_"):
        dim: many[MultiArrayDimension]
        data_offset: uint32

    @dataclass
    class Float32MultiArray(IdlStruct, typename="std_msgs::msg::dds_::Float32MultiArray_"):
        layout: MultiArrayLayout
        data: many[float32]

    @dataclass
    class PointField(IdlStruct, typename="sensor_msgs::msg::dds_::PointField_"):
        name: str
        offset: uint32
        datatype: uint8
        count: uint32

    @dataclass
    class PointCloud2(IdlStruct, typename="sensor_msgs::msg::dds_::PointCloud2_"):
        header: Header
        height: uint32
        width: uint32
        fields: many[PointField]
        is_bigendian: bool
        point_step: uint32
        row_step: uint32
        data: many[uint8]
        is_dense: bool

    @dataclass
    class Frame(IdlStruct, typename="taxel_msgs::msg::dds_::Frame_"):
        stamp: Time
        sequence: uint64
        device_time_ns: uint64
        arrival_ns: uint64
        flags: uint8
        values: many[float64]

    every = (
        Time, Header, Vector3, Wrench, WrenchStamped, Image, PointField, PointCloud2, MultiArrayDimension, MultiArrayLayout,
        Float32MultiArray, Frame,
    )
    return {kind.__name__: kind for kind in every}


def publisher():
    """The way that this machine has."""
    for way in (ByRclpy, ByCyclone):
        try:
            return way()
        except ImportError:
            pass
    raise TaxelError("neither rclpy nor cyclonedds is here: source a ROS 2, or pip install cyclonedds")


def numbers(rows):
    """The numbers of nested rows, one after the other."""
    return [float(number) for row in rows for number in (row if hasattr(row, "__len__") else [row])]


def messages(way, live, frame, name):
    """The messages of a frame by topic; `name` is the frame of the sensor."""
    hello, unknown = live.hello, [float("nan")] * 3
    exact, bounds = hello["certainties"].index("exact"), [hello["states"].index(state) for state in BOUNDS]
    rows, columns, each = (hello[key] for key in ("rows", "columns", "components"))
    seconds, nanoseconds = divmod(time.time_ns(), 10**9)
    stamp = {"stamp__sec": seconds, "stamp__nanosec": nanoseconds}
    head = {"header__" + key: value for key, value in stamp.items()} | {"header__frame_id": name}
    is_exact = frame.total_certainty == exact
    x, y, pressing = (float(force) for force in (frame.force if is_exact else unknown))
    moment = dict(zip("xyz", (float(part) for part in (frame.moment if is_exact else unknown))))
    yield "/taxel/wrench", way.make(
        "WrenchStamped", **head, wrench__force__x=x, wrench__force__y=y, wrench__force__z=-pressing,
        **{"wrench__torque__" + axis: part for axis, part in moment.items()},
    )
    values, states = numbers(frame.values), numbers(frame.states)
    values = [unknown[0] if states[place // each] in bounds else value for place, value in enumerate(values)]
    yield "/taxel/image", way.make(
        "Image", **head, height=rows, width=columns, encoding="32FC3" if each == 3 else "32FC1", is_bigendian=0,
        step=4 * each * columns, data=list(struct.pack(f"<{len(values)}f", *values)),
    )
    points = []
    for contact in frame.contacts:
        force = contact.force if contact.certainty == exact else unknown
        points += [*contact.centre, 0.0, *force, contact.force_deviation[2], contact.id]
    fields = [
        way.make("PointField", name=field, offset=4 * place, datatype=FLOAT32, count=1) for place, field in enumerate(FIELDS)
    ]
    step = 4 * len(FIELDS)
    yield "/taxel/contacts", way.make(
        "PointCloud2", **head, height=1, width=len(frame.contacts), fields=fields, is_bigendian=False, point_step=step,
        row_step=step * len(frame.contacts), data=list(struct.pack(f"<{len(points)}f", *points)), is_dense=True,
    )
    readings = [float(reading) for reading in frame.readings]
    yield "/taxel/readings", way.make("Float32MultiArray", data=readings)
    if way.has("/taxel/frame"):
        yield "/taxel/frame", way.make(
            "Frame", **stamp, sequence=frame.sequence, device_time_ns=frame.time_ns,
            arrival_ns=NOT_KNOWN if frame.host_ns is None else frame.host_ns, flags=frame.flags, values=readings,
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("address", help="the address that taxel live prints")
    parser.add_argument("--frame", default="taxel", help="frame of the sensor in all heads")
    parser.add_argument("--once", type=int, help="end after so many frames")
    arguments = parser.parse_args()
    try:
        with TaxelLive(arguments.address) as live:
            way = publisher()
            for count, frame in enumerate(live.frames(), 1):
                for name, message in messages(way, live, frame, arguments.frame):
                    way.publish(name, message)
                if count == arguments.once:
                    break
    except TaxelError as error:
        sys.exit(f"error: {error}")
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
