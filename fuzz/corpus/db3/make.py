"""The bags of this folder: the first messages of tests/ros2/humble.db3.zstd in small pages, as rosbag2 of Humble and of Iron makes its tables.

Versions: Python 3.11, SQLite 3.40.1.

    zstd -d tests/ros2/humble.db3.zstd && python3 fuzz/corpus/db3/make.py tests/ros2/humble.db3 && rm tests/ros2/humble.db3
"""

import sqlite3
import sys
from pathlib import Path

HERE = Path(__file__).parent
MESSAGES = 48
TOPICS = "CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL)"
ROWS = "CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, data BLOB NOT NULL)"
DEFINITIONS = (
    "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY,topic_type TEXT NOT NULL,encoding TEXT NOT NULL,"
    "encoded_message_definition TEXT NOT NULL,type_description_hash TEXT NOT NULL)"
)
HEADER = "\n" + "=" * 80 + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
HEADER += "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
JOINT_STATE = "std_msgs/Header header\n\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort" + HEADER


def bag(name, page_bytes, has_definitions):
    """One file. The index on times is last, as rosbag2 has it."""
    path = HERE / name
    path.unlink(missing_ok=True)
    source, made = sqlite3.connect(sys.argv[1]), sqlite3.connect(path)
    made.execute(f"PRAGMA page_size = {page_bytes}")
    made.execute(TOPICS)
    made.execute(ROWS)
    for row in source.execute("SELECT id, name, type, serialization_format, offered_qos_profiles FROM topics ORDER BY id"):
        made.execute("INSERT INTO topics VALUES(?, ?, ?, ?, ?)", row)
    if has_definitions:
        made.execute(DEFINITIONS)
        made.execute("INSERT INTO message_definitions VALUES(1, 'sensor_msgs/msg/JointState', 'ros2msg', ?, '')", (JOINT_STATE,))
    for row in source.execute("SELECT id, topic_id, timestamp, data FROM messages ORDER BY id LIMIT ?", (MESSAGES,)):
        made.execute("INSERT INTO messages VALUES(?, ?, ?, ?)", row)
    made.execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
    made.commit()
    made.close()


bag("humble.db3", 1024, has_definitions=False)
bag("iron.db3", 512, has_definitions=True)
