//! `yair import ros2` of bags of ROS 1, by another writer (`tests/ros2/make_bags.py`), and poses by chains of
//! transforms.

use std::fs;

use ros_bag::McapWriter;

use crate::import_ros2::{ROBOT, bag, calibrates, imported};
use crate::support::{document, refusal};

/// Flags of poses by transforms.
fn chain(frames: &str) -> [&str; 4] {
    ["--truth", "/tf", "--truth-frames", frames]
}

#[test]
fn import_ros2_a_bag_of_ros_1_gives_the_rows_of_that_of_ros_2() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let (expected, _) = imported(at, &bag("zstd.mcap"), &[]);
    let (found, warnings) = imported(at, &bag("ros1_lz4.bag"), &[]);
    assert!((&found, &warnings[..]) == (&expected, ""), "{warnings}");
    calibrates(at);
    assert!(fs::read_to_string(at.join("new/dataset.toml")).expect("a manifest").contains("ROS 1 bag: wheels of"));
    let listed = document(at, &["import", "ros1", &bag("ros1_lz4.bag"), "--list"]);
    assert_eq!(listed["topics"][0]["type"], "sensor_msgs/msg/JointState");
    assert_eq!((&listed["wheels"], &listed["truth"]), (&"/joint_states".into(), &"/robot/pose".into()));
    // The first two seconds, not compressed: cut off, everything before is read.
    let whole = include_bytes!("../../fuzz/corpus/ros1/poses.bag");
    fs::write(at.join("cut.bag"), &whole[..whole.len() / 2]).expect("written");
    let (found, warnings) = imported(at, "cut.bag", &[]);
    assert!(warnings.contains("the file is cut off") && warnings.contains("everything before was read"), "{warnings}");
    let rows = found[0].lines().count();
    assert!((5..27).contains(&rows) && expected[0].starts_with(&found[0]), "{rows}");
}

#[test]
fn import_ros2_transforms_are_chained_to_the_base() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    // A marker that stands on the base, by /tf_static.
    let (mounted, warnings) = imported(at, &bag("ros1_bz2.bag"), &chain("mocap,base_link"));
    assert_eq!((mounted[1].lines().count(), &warnings[..]), (1 + 221, ""));
    calibrates(at);
    // The base's poses are those of the other bags, to their tenths of a millimetre.
    let (plain, _) = imported(at, &bag("zstd.mcap"), &[]);
    let rows = |table: &str| -> Vec<Vec<f64>> {
        let numbers =
            |line: &str| line.split(',').skip(1).take(4).map(|cell| cell.parse().expect("a number")).collect();
        table.lines().skip(1).map(numbers).collect()
    };
    for (found, expected) in rows(&mounted[1]).iter().zip(rows(&plain[1])) {
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-4), "{found:?} {expected:?}");
    }
    // Odometry that is wrong by 1 and 2 %, and a map that is corrected every half a second.
    let (corrected, warnings) = imported(at, &bag("ros1_bz2.bag"), &chain("/map,base_link"));
    let said =
        "topic /tf: odom to base_link is the wheels' own odometry: of 133 messages of map to odom the 44 are poses";
    assert!(warnings.contains(said), "{warnings}");
    assert_eq!(corrected[1].lines().count(), 1 + 44);
    calibrates(at);
    for (frames, why) in [
        (
            "map,camera",
            "no chain of them leads there; there are map,odom mocap,marker odom,base_link, and by /tf_static base_link,marker",
        ),
        ("map,mocap", "no transform from map directly to mocap"),
        ("base_link,marker", "base_link to marker does not move"),
    ] {
        let import = ["import", "ros2", &bag("ros1_bz2.bag"), "--out", "other"];
        let message = refusal(at, &[&import[..], &ROBOT, &chain(frames)].concat());
        assert!(message.contains(why), "{message}");
    }
    assert!(!at.join("other").exists());
}

#[test]
fn import_ros2_messages_of_ros_1_in_mcap_are_read_too() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let mut writer = McapWriter::new("", "");
    let schema = writer.add_schema("my_msgs/Wheels", "ros1msg", "uint8 id\nint32 left").expect("a schema");
    let channel = writer.add_channel(schema, "/wheels", "ros1", &[]).expect("a channel");
    for second in 0..3_u32 {
        // Nothing stands between the number of one byte and that of four.
        writer.push(channel, second, 1_000_000_000 * u64::from(second), &[7, 1, 0, 0, 0]);
    }
    fs::write(at.join("a.mcap"), writer.finish()).expect("written");
    let listed = document(at, &["import", "ros2", "a.mcap", "--list"]);
    let topic = &listed["topics"][0];
    assert_eq!((&topic["type"], &topic["messages"]), (&"my_msgs/msg/Wheels".into(), &3.into()));
    assert_eq!(topic["numbers"], serde_json::json!(["id", "left"]));
}
