"""The bags of this folder, by writers that are not ours.

Versions: Python 3.11, mcap 1.6.0, mcap-ros2-support 0.6.0, rosbags 0.11.9, zstandard 0.25.0, lz4 4.4.5.

    python3 -m venv venv && venv/bin/pip install mcap==1.6.0 mcap-ros2-support==0.6.0 rosbags==0.11.9
    venv/bin/python make_bags.py

A robot of 150 mm wheels, 300 mm apart by its data sheet, in truth of 153.0 and 152.7 mm, 309.0 mm apart, drives straights, spins both ways
and arcs for 22 s. Angles of its wheels are read 20 times a second, poses to 0.1 mm and 0.1 mrad 10 times.
"""

import math
import shutil
from pathlib import Path

import numpy as np
import zstandard
from mcap.writer import CompressionType, Writer as RawWriter
from mcap_ros2.writer import Writer
from rosbags.rosbag1 import Writer as Rosbag1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer as Rosbag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

HERE = Path(__file__).parent
START_NS = 1_764_000_000_123_456_789
SPEEDS = [(0.4, 0.0, 60), (0.0, 0.8, 80), (0.4, 0.0, 60), (0.0, -0.8, 80), (0.4, 0.5, 80), (0.4, -0.5, 80)]
EQUALS = "=" * 80 + "\n"
HEADER = (
    EQUALS + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    + EQUALS + "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
JOINT_STATE = "std_msgs/Header header\n\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n" + HEADER
POSE_STAMPED = (
    "# A Pose with reference coordinate frame and timestamp\n\nstd_msgs/Header header\nPose pose\n"
    + EQUALS + "MSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n"
    + EQUALS + "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n"
    + EQUALS + "MSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"
    + HEADER
)
ENCODERS = "std_msgs/Header header\nint32 MAX=2147483647\nint32 left\nint32 right\n"


def drive():
    """Rows of 50 ms: nanoseconds, wheel angles, pose."""
    wheels, x, y, theta = [0.0, 0.0], 0.0, 0.0, 0.0
    rows = [(0, *wheels, x, y, theta)]
    for speed, yaw_rate, count in SPEEDS:
        for _ in range(count):
            moved, turned = speed / 20, yaw_rate / 20
            chord = moved if turned == 0 else moved * math.sin(turned / 2) / (turned / 2)
            x, y = x + chord * math.cos(theta + turned / 2), y + chord * math.sin(theta + turned / 2)
            theta += turned
            wheels = [
                wheels[0] + (moved - turned * 0.309 / 2) / 0.0765,
                wheels[1] + (moved + turned * 0.309 / 2) / 0.07635,
            ]
            rows.append((len(rows) * 50_000_000, *wheels, x, y, theta))
    return rows


def header(t_ns, frame):
    return {"stamp": {"sec": (START_NS + t_ns) // 10**9, "nanosec": (START_NS + t_ns) % 10**9}, "frame_id": frame}


def joint_state(t_ns, left, right):
    # The castor and the order are there to be told apart.
    names, positions = ["castor_joint", "wheel_right_joint", "wheel_left_joint"], [0.0, right, left]
    return {"header": header(t_ns, ""), "name": names, "position": positions, "velocity": [], "effort": []}


def pose_stamped(t_ns, x, y, theta):
    theta = round(theta, 4)
    orientation = {"x": 0.0, "y": 0.0, "z": math.sin(theta / 2), "w": math.cos(theta / 2)}
    return {"header": header(t_ns, "mocap"), "pose": {"position": {"x": round(x, 4), "y": round(y, 4), "z": 0.1}, "orientation": orientation}}


def mcap_file(path, unindexed=False, description=None, **options):
    """One MCAP file; log times are 3 ms after the stamps."""
    with open(path, "wb") as stream:
        writer = Writer(stream, **options)
        if unindexed:
            # mcap_ros2 passes on no such option: no chunks, no summary, no index, records alone.
            writer._writer = RawWriter(stream, use_chunking=False, use_statistics=False, repeat_channels=False, repeat_schemas=False, use_summary_offsets=False)
            stream.seek(0)
            stream.truncate()
            writer._writer.start(profile="ros2", library="mcap 1.6.0")
        joints = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        poses = writer.register_msgdef("geometry_msgs/msg/PoseStamped", POSE_STAMPED)
        if description is not None:
            text = writer.register_msgdef("std_msgs/msg/String", "string data\n")
            writer.write_message("/robot_description", text, {"data": description}, log_time=START_NS, publish_time=START_NS)
        for number, (t_ns, left, right, x, y, theta) in enumerate(drive()):
            at = {"log_time": START_NS + t_ns + 3_000_000, "publish_time": START_NS + t_ns}
            writer.write_message("/joint_states", joints, joint_state(t_ns, left, right), **at)
            if number % 2 == 0:
                writer.write_message("/robot/pose", poses, pose_stamped(t_ns, x, y, theta), **at)
        writer.finish()


def two_topics(path):
    """Each wheel's counts on a topic of its own, without a header, the right one's 20 ms after the left one's."""
    with open(path, "wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD)
        counts = writer.register_msgdef("std_msgs/msg/Int32", "int32 data\n")
        poses = writer.register_msgdef("geometry_msgs/msg/PoseStamped", POSE_STAMPED)
        rows = drive()
        messages = []
        for number, (t_ns, left, right, x, y, theta) in enumerate(rows):
            later = rows[min(number + 1, len(rows) - 1)][2]
            for topic, at_ns, angle in [("/left/encoder", t_ns, left), ("/right/encoder", t_ns + 20_000_000, right + 0.4 * (later - right))]:
                messages.append((at_ns, topic, counts, {"data": math.floor(angle / math.tau * 4096)}))
            if number % 2 == 0:
                messages.append((t_ns, "/robot/pose", poses, pose_stamped(t_ns, x, y, theta)))
        for t_ns, topic, schema, message in sorted(messages, key=lambda message: message[0]):
            writer.write_message(topic, schema, message, log_time=START_NS + t_ns, publish_time=START_NS + t_ns)
        writer.finish()


def compressed(path, **options):
    """A file that is compressed as a whole, as rosbag2 does it: the smallest way to keep one that is not compressed inside."""
    mcap_file(path, **options)
    path.with_name(path.name + ".zstd").write_bytes(zstandard.ZstdCompressor(level=19).compress(path.read_bytes()))
    path.unlink()


def rosbag2(path, mode, every=1):
    """A folder with metadata.yaml, by another writer: 16-bit counts that wrap, in a type of one's own, receipts alone for the wheels, transforms for the
    poses."""
    shutil.rmtree(path, ignore_errors=True)
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg("uint16 left\nuint16 right\n", "my_robot_msgs/msg/Encoders"))
    types = store.types
    bag = Rosbag2(path, version=9, storage_plugin=StoragePlugin.MCAP)
    if mode is not None:
        bag.set_compression(mode, CompressionFormat.ZSTD)
    with bag:
        wheels = bag.add_connection("/encoders", "my_robot_msgs/msg/Encoders", typestore=store)
        frames = bag.add_connection("/tf", "tf2_msgs/msg/TFMessage", typestore=store)
        for number, (t_ns, left, right, x, y, theta) in enumerate(drive()[::every]):
            counts = [(math.floor(angle / math.tau * 4096) + 50000) % 65536 for angle in (left, right)]
            message = types["my_robot_msgs/msg/Encoders"](*counts)
            bag.write(wheels, START_NS + t_ns, store.serialize_cdr(message, "my_robot_msgs/msg/Encoders"))
            if number % 2:
                continue
            theta = round(theta, 4)
            of = header(t_ns, "world")
            stamp = types["builtin_interfaces/msg/Time"](**of["stamp"])
            transforms = []
            for parent, child, moved in [("odom", "base_link", 9.0), ("world", "base_link", 0.0)]:
                transforms.append(types["geometry_msgs/msg/TransformStamped"](
                    types["std_msgs/msg/Header"](stamp, parent),
                    child,
                    types["geometry_msgs/msg/Transform"](
                        types["geometry_msgs/msg/Vector3"](round(x, 4) + moved, round(y, 4), 0.0),
                        types["geometry_msgs/msg/Quaternion"](0.0, 0.0, math.sin(theta / 2), math.cos(theta / 2)),
                    ),
                ))
            message = types["tf2_msgs/msg/TFMessage"](transforms)
            bag.write(frames, START_NS + t_ns, store.serialize_cdr(message, "tf2_msgs/msg/TFMessage"))


def sqlite(path, version):
    """One file of SQLite, every second row: of version 8 as ROS 2 Humble and before record it, without definitions."""
    folder = path.with_suffix(".folder")
    shutil.rmtree(folder, ignore_errors=True)
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types

    def message(type_name, fields):
        """A message of dictionaries as one of its type."""
        kinds = dict(store.fielddefs[type_name][1])
        def of(kind, value):
            if isinstance(value, dict):
                return message(kind[1], value)
            if isinstance(value, list) and (not value or isinstance(value[0], float)):
                return np.array(value, dtype=np.float64)
            return value
        return types[type_name](**{name: of(kinds[name], value) for name, value in fields.items()})

    with Rosbag2(folder, version=version, storage_plugin=StoragePlugin.SQLITE3) as bag:
        joints = bag.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
        poses = bag.add_connection("/robot/pose", "geometry_msgs/msg/PoseStamped", typestore=store)
        for number, (t_ns, left, right, x, y, theta) in enumerate(drive()[::2]):
            for connection, fields in [(joints, joint_state(t_ns, left, right)), (poses, pose_stamped(t_ns, x, y, theta))][: 1 + (number % 2 == 0)]:
                data = store.serialize_cdr(message(connection.msgtype, fields), connection.msgtype)
                bag.write(connection, START_NS + t_ns + 3_000_000, data)
    (whole,) = folder.glob("*.db3")
    path.with_name(path.name + ".zstd").write_bytes(zstandard.ZstdCompressor(level=19).compress(whole.read_bytes()))
    shutil.rmtree(folder)


def ros1_store():
    """Types of ROS 1, and both of transforms."""
    store = get_typestore(Stores.ROS1_NOETIC)
    for name in ["tf/msg/tfMessage", "tf2_msgs/msg/TFMessage"]:
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", name))
    return store


def ros1(path, messages):
    """One bag of ROS 1: topic, type, nanoseconds and fields of each message; receipts are 3 ms late."""
    path.unlink(missing_ok=True)
    store = ros1_store()

    def message(type_name, fields):
        kinds = dict(store.fielddefs[type_name][1])
        def of(kind, value):
            if isinstance(value, dict):
                return message(kind[1], {"seq": 7, **value} if kind[1] == "std_msgs/msg/Header" else value)
            if isinstance(value, list) and value and isinstance(value[0], dict):
                return [message(kind[1][0][1], one) for one in value]
            if isinstance(value, list) and (not value or isinstance(value[0], float)):
                return np.array(value, dtype=np.float64)
            return value
        built = {name: of(kinds[name], value) for name, value in fields.items()}
        if type_name == "builtin_interfaces/msg/Time":
            built = {name: int(value) for name, value in built.items()}
        return store.types[type_name](**built)

    bag = Rosbag1(path)
    for name, format in [("lz4", Rosbag1.CompressionFormat.LZ4), ("bz2", Rosbag1.CompressionFormat.BZ2)]:
        if name in path.name:
            bag.set_compression(format)
    with bag:
        connections = {}
        for topic, type_name, t_ns, fields in messages:
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, type_name, typestore=store)
            bag.write(connections[topic], START_NS + t_ns + 3_000_000, store.serialize_ros1(message(type_name, fields), type_name))


def plain_ros1():
    """The messages of the MCAP files."""
    for number, (t_ns, left, right, x, y, theta) in enumerate(drive()):
        yield "/joint_states", "sensor_msgs/msg/JointState", t_ns, joint_state(t_ns, left, right)
        if number % 2 == 0:
            yield "/robot/pose", "geometry_msgs/msg/PoseStamped", t_ns, pose_stamped(t_ns, x, y, theta)


def chained_ros1():
    """Every second row; a marker that motion capture sees, which stands on the base, and a map that is corrected every 0.5 s and published every
    0.2 s, from which odometry leads that is wrong by 1 and 2 %."""
    def after(a, b):
        return [a[0] + math.cos(a[2]) * b[0] - math.sin(a[2]) * b[1], a[1] + math.sin(a[2]) * b[0] + math.cos(a[2]) * b[1], a[2] + b[2]]

    def back(a):
        return [-math.cos(a[2]) * a[0] - math.sin(a[2]) * a[1], math.sin(a[2]) * a[0] - math.cos(a[2]) * a[1], -a[2]]

    def transforms(t_ns, *those):
        of = lambda parent, child, pose: {
            "header": header(t_ns, parent),
            "child_frame_id": child,
            "transform": {
                "translation": {"x": pose[0], "y": pose[1], "z": 0.0},
                "rotation": {"x": 0.0, "y": 0.0, "z": math.sin(pose[2] / 2), "w": math.cos(pose[2] / 2)},
            },
        }
        return {"transforms": [of(*one) for one in those]}

    marker = [0.1, 0.05, 0.5]
    yield "/tf_static", "tf2_msgs/msg/TFMessage", 0, transforms(0, ("base_link", "marker", marker))
    correction = None
    for number, (t_ns, left, right, x, y, theta) in enumerate(drive()[::2]):
        yield "/joint_states", "sensor_msgs/msg/JointState", t_ns, joint_state(t_ns, left, right)
        odometry = [1.01 * x, 1.01 * y, 1.02 * theta]
        frames = [("/odom", "/base_link", odometry), ("/mocap", "/marker", after([x, y, theta], marker))]
        if number % 5 == 0:
            correction = after([x, y, theta], back(odometry))
        if number % 2 == 0 or number % 5 == 0:
            frames.append(("/map", "/odom", correction))
        yield "/tf", "tf/msg/tfMessage", t_ns, transforms(t_ns, *frames)


compressed(HERE / "plain.mcap", compression=CompressionType.NONE)
compressed(HERE / "unindexed.mcap", unindexed=True)
mcap_file(HERE / "lz4.mcap", compression=CompressionType.LZ4, chunk_size=16384)
mcap_file(HERE / "zstd.mcap", compression=CompressionType.ZSTD, chunk_size=16384)
mcap_file(HERE / "described.mcap", description=(HERE / "robot.urdf").read_text(), compression=CompressionType.ZSTD, chunk_size=16384)
rosbag2(HERE / "by_file", CompressionMode.FILE)
rosbag2(HERE / "by_message", CompressionMode.MESSAGE, every=3)
two_topics(HERE / "two_topics.mcap")
sqlite(HERE / "humble.db3", version=8)
ros1(HERE / "ros1_lz4.bag", plain_ros1())
ros1(HERE / "ros1_bz2.bag", chained_ros1())
# Those of fuzz/corpus/ros1: the first seconds.
CORPUS = HERE.parent.parent / "fuzz/corpus/ros1"
for end in ["", "_lz4", "_bz2"]:
    ros1(CORPUS / f"poses{end}.bag", list(plain_ros1())[:40])
ros1(CORPUS / "transforms.bag", list(chained_ros1())[:80])
