"""Reads a bag of `yair export mcap tests/evo/robot` by programs that are not ours, and compares APE with golden.json.

    python read_bag.py robot.mcap
"""

import json
import sys
from collections import Counter
from pathlib import Path

from evo import main_ape
from evo.core import sync
from evo.core.metrics import PoseRelation
from evo.tools import file_interface
from mcap_ros2.reader import read_ros2_messages
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

# 63 + 62 rows by two paths and 32 + 31 poses of the truth.
EXPECTED = {
    "/truth": 63, "/path/truth": 2, "/odom/nominal": 124, "/path/nominal": 2, "/joint_states": 124, "/tf": 187,
}

bag = Path(sys.argv[1])
found, last_ns = Counter(), 0
for message in read_ros2_messages(str(bag)):
    found[message.channel.topic] += 1
    assert message.log_time_ns >= last_ns, "times of receipt fall"
    last_ns = message.log_time_ns
assert found == EXPECTED, found

store = get_typestore(Stores.ROS2_HUMBLE)
by_rosbags = Counter()
with Reader(bag) as reader:
    for connection, _, raw in reader.messages():
        message = store.deserialize_cdr(raw, connection.msgtype)
        assert bytes(store.serialize_cdr(message, connection.msgtype)) == bytes(raw), f"{connection.topic}: other bytes"
        by_rosbags[connection.topic] += 1
    truth, odometry = (file_interface.read_bag_trajectory(reader, topic) for topic in ["/truth", "/odom/nominal"])
assert by_rosbags == EXPECTED, by_rosbags

# Both runs after each other: the root of the mean of the squares of both.
golden = json.loads((Path(__file__).parent / "golden.json").read_text())["robot"]
reference, estimate = sync.associate_trajectories(truth, odometry)
result = main_ape.ape(reference, estimate, pose_relation=PoseRelation.translation_part)
counts = {"square": 31, "free": 32}
squares = sum(count * golden[run]["ape"]["none"]["translation_m"]["rmse"] ** 2 for run, count in counts.items())
expected = (squares / sum(counts.values())) ** 0.5
assert abs(result.stats["rmse"] - expected) < 1e-9, (result.stats["rmse"], expected)
print(f"{bag}: {sum(found.values())} messages read by mcap-ros2-support, rosbags and evo; APE {expected:.9f} m")
