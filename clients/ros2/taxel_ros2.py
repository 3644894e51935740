"""Bridge from `taxel live` to ROS 2.

    taxel_ros2.py ADDRESS [--frame taxel] [--once N]

Publishes, with the time at which a frame came here as stamp:

    /taxel/wrench    geometry_msgs/WrenchStamped   total on the sensor, right-handed: what presses is negative along z
    /taxel/image     sensor_msgs/Image             values of the taxels, 32FC1 (pressing) or 32FC3 (x, y, pressing), SI
    /taxel/readings  std_msgs/Float32MultiArray    readings of all channels, SI

These types have no place to say that a number is a bound: a total that is not exact, and the value of a taxel at an end of what can be
read, are NaN.

By `rclpy` where a ROS 2 is sourced; otherwise by `cyclonedds` (pip install cyclonedds), under the names that ROS 2 gives to topics and
types, so that nodes on the same network and domain (ROS_DOMAIN_ID) see them.
"""

import argparse
import os
import pathlib
import struct
import sys
import time
from dataclasses import dataclass

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "python"))
from taxel_live import TaxelError, TaxelLive  # noqa: E402


# States in which a value is no more than a bound.
BOUNDS = "closed", "out_of_range", "saturated"


class ByRclpy:
    """Publishes with the libraries of a ROS 2 installation."""

    def __init__(self):
        import rclpy
        from geometry_msgs.msg import WrenchStamped
        from sensor_msgs.msg import Image
        from std_msgs.msg import Float32MultiArray

        rclpy.init()
        self._types = WrenchStamped, Image, Float32MultiArray
        self._node = rclpy.create_node("taxel")
        names = "/taxel/wrench", "/taxel/image", "/taxel/readings"
        self._publishers = [self._node.create_publisher(kind, name, 10) for kind, name in zip(self._types, names)]

    def _head(self, message, stamp, frame):
        message.header.stamp.sec, message.header.stamp.nanosec = stamp
        message.header.frame_id = frame

    def publish(self, stamp, frame, force, moment, image, readings):
        wrench, picture, array = (kind() for kind in self._types)
        self._head(wrench, stamp, frame)
        for part, values in ((wrench.wrench.force, force), (wrench.wrench.torque, moment)):
            part.x, part.y, part.z = values
        self._head(picture, stamp, frame)
        picture.height, picture.width, picture.encoding, picture.step, data = image
        picture.data = list(data)
        array.data = readings
        for publisher, message in zip(self._publishers, (wrench, picture, array)):
            publisher.publish(message)


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
        topics = ("wrench", "WrenchStamped"), ("image", "Image"), ("readings", "Float32MultiArray")
        self._writers = [
            DataWriter(participant, Topic(participant, f"rt/taxel/{name}", self._kinds[kind]), qos=qos) for name, kind in topics
        ]

    def publish(self, stamp, frame, force, moment, image, readings):
        kinds = self._kinds
        header = kinds["Header"](stamp=kinds["Time"](*stamp), frame_id=frame)
        vector = kinds["Vector3"]
        height, width, encoding, step, data = image
        messages = (
            kinds["WrenchStamped"](header, kinds["Wrench"](vector(*force), vector(*moment))),
            kinds["Image"](header, height, width, encoding, 0, step, list(data)),
            kinds["Float32MultiArray"](kinds["MultiArrayLayout"]([], 0), readings),
        )
        for writer, message in zip(self._writers, messages):
            writer.write(message)


def kinds():
    """The types of ROS 2 as cyclonedds takes them, by name."""
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl.types import float32, float64, int32, sequence, uint8, uint32

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
        data: sequence[uint8]

    @dataclass
    class MultiArrayDimension(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayDimension_"):
        label: str
        size: uint32
        stride: uint32

    @dataclass
    class MultiArrayLayout(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayLayout_"):
        dim: sequence[MultiArrayDimension]
        data_offset: uint32

    @dataclass
    class Float32MultiArray(IdlStruct, typename="std_msgs::msg::dds_::Float32MultiArray_"):
        layout: MultiArrayLayout
        data: sequence[float32]

    every = Time, Header, Vector3, Wrench, WrenchStamped, Image, MultiArrayLayout, Float32MultiArray
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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("address", help="the address that taxel live prints")
    parser.add_argument("--frame", default="taxel", help="frame of the sensor in all heads")
    parser.add_argument("--once", type=int, help="end after so many frames")
    arguments = parser.parse_args()
    try:
        with TaxelLive(arguments.address) as live:
            way = publisher()
            rows, columns, each = (live.hello[key] for key in ("rows", "columns", "components"))
            encoding, step = ("32FC3" if each == 3 else "32FC1"), 4 * each * columns
            exact, bounds = live.hello["certainties"].index("exact"), [live.hello["states"].index(name) for name in BOUNDS]
            unknown = [float("nan")] * 3
            for count, frame in enumerate(live.frames(), 1):
                now = time.time_ns()
                is_exact = frame.total_certainty == exact
                x, y, pressing = (float(force) for force in (frame.force if is_exact else unknown))
                values, states = numbers(frame.values), numbers(frame.states)
                values = [unknown[0] if states[place // each] in bounds else value for place, value in enumerate(values)]
                image = rows, columns, encoding, step, struct.pack(f"<{len(values)}f", *values)
                moment = [float(part) for part in (frame.moment if is_exact else unknown)]
                readings = [float(reading) for reading in frame.readings]
                stamp = divmod(now, 10**9)
                way.publish(stamp, arguments.frame, (x, y, -pressing), moment, image, readings)
                if count == arguments.once:
                    break
    except TaxelError as error:
        sys.exit(f"error: {error}")
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
