//! Definitions of types that a bag itself does not define: usual ones, and those of files that are given.
//!
//! The usual ones are those of common_interfaces, geometry2, control_msgs and of the robots whose wheels are
//! known (ROS 2 Humble to Rolling, in which they are the same), without comments and constants.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::definition::{Definitions, full_name};
use crate::error::RosBagError;
use crate::settings::MAX_DEFINITION_BYTES;

const HEADER: &str = "std_msgs/Header header\n";

/// Fields of usual types.
const USUAL: [(&str, &[&str]); 34] = [
    ("builtin_interfaces/Time", &["int32 sec\nuint32 nanosec\n"]),
    ("std_msgs/Header", &["builtin_interfaces/Time stamp\nstring frame_id\n"]),
    ("std_msgs/Int16", &["int16 data\n"]),
    ("std_msgs/Int32", &["int32 data\n"]),
    ("std_msgs/Int64", &["int64 data\n"]),
    ("std_msgs/UInt32", &["uint32 data\n"]),
    ("std_msgs/Float32", &["float32 data\n"]),
    ("std_msgs/Float64", &["float64 data\n"]),
    ("std_msgs/MultiArrayDimension", &["string label\nuint32 size\nuint32 stride\n"]),
    ("std_msgs/MultiArrayLayout", &["std_msgs/MultiArrayDimension[] dim\nuint32 data_offset\n"]),
    ("std_msgs/Int32MultiArray", &["std_msgs/MultiArrayLayout layout\nint32[] data\n"]),
    ("std_msgs/Int64MultiArray", &["std_msgs/MultiArrayLayout layout\nint64[] data\n"]),
    ("std_msgs/Float32MultiArray", &["std_msgs/MultiArrayLayout layout\nfloat32[] data\n"]),
    ("std_msgs/Float64MultiArray", &["std_msgs/MultiArrayLayout layout\nfloat64[] data\n"]),
    ("geometry_msgs/Point", &["float64 x\nfloat64 y\nfloat64 z\n"]),
    ("geometry_msgs/Vector3", &["float64 x\nfloat64 y\nfloat64 z\n"]),
    ("geometry_msgs/Quaternion", &["float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"]),
    ("geometry_msgs/Pose", &["geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"]),
    ("geometry_msgs/PoseStamped", &[HEADER, "geometry_msgs/Pose pose\n"]),
    ("geometry_msgs/PoseWithCovariance", &["geometry_msgs/Pose pose\nfloat64[36] covariance\n"]),
    ("geometry_msgs/PoseWithCovarianceStamped", &[HEADER, "geometry_msgs/PoseWithCovariance pose\n"]),
    ("geometry_msgs/Twist", &["geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"]),
    ("geometry_msgs/TwistStamped", &[HEADER, "geometry_msgs/Twist twist\n"]),
    ("geometry_msgs/TwistWithCovariance", &["geometry_msgs/Twist twist\nfloat64[36] covariance\n"]),
    ("geometry_msgs/Transform", &["geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"]),
    ("geometry_msgs/TransformStamped", &[HEADER, "string child_frame_id\ngeometry_msgs/Transform transform\n"]),
    ("tf2_msgs/TFMessage", &["geometry_msgs/TransformStamped[] transforms\n"]),
    (
        "nav_msgs/Odometry",
        &[
            HEADER,
            "string child_frame_id\ngeometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n",
        ],
    ),
    ("nav_msgs/Path", &[HEADER, "geometry_msgs/PoseStamped[] poses\n"]),
    ("sensor_msgs/JointState", &[HEADER, "string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"]),
    (
        "sensor_msgs/Imu",
        &[
            HEADER,
            "geometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n",
            "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n",
            "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
        ],
    ),
    (
        "sensor_msgs/LaserScan",
        &[
            HEADER,
            "float32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\nfloat32 time_increment\n",
            "float32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] intensities\n",
        ],
    ),
    ("control_msgs/InterfaceValue", &["string[] interface_names\nfloat64[] values\n"]),
    (
        "control_msgs/DynamicJointState",
        &[HEADER, "string[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values\n"],
    ),
];

/// Definitions by full name (`package/Type`): fields of the type alone.
#[derive(Debug, Clone, Default)]
pub(crate) struct KnownTypes {
    given: BTreeMap<String, String>,
}

impl KnownTypes {
    /// The usual types, and those of files named `…/PACKAGE/msg/TYPE.msg` or `PACKAGE/TYPE=FILE`.
    pub(crate) fn with_files(files: &[PathBuf]) -> Result<Self, RosBagError> {
        let mut given = BTreeMap::new();
        for file in files {
            let (name, path) = named(file)?;
            let io = |source| RosBagError::Io { path: path.clone(), source };
            let wrong = |why: String| RosBagError::DefinitionFile { file: path.clone(), why };
            if std::fs::metadata(&path).map_err(io)?.len() > MAX_DEFINITION_BYTES {
                return Err(wrong(format!("longer than {} KiB", MAX_DEFINITION_BYTES >> 10)));
            }
            let mut text = String::new();
            let file = std::fs::File::open(&path).map_err(io)?;
            file.take(MAX_DEFINITION_BYTES).read_to_string(&mut text).map_err(io)?;
            Definitions::fields_of(&name, &text).map_err(wrong)?;
            given.insert(name, text);
        }
        Ok(Self { given })
    }

    /// The whole definition of a type, as a schema holds it: its own fields, then every type inside once.
    /// `None` where one of these types is not known.
    pub(crate) fn definition(&self, type_name: &str) -> Option<String> {
        let root = full_name(type_name, "");
        let mut text = self.fields(&root)?;
        let mut names = vec![root];
        let mut next = 0;
        while let Some(name) = names.get(next).cloned() {
            for inside in Definitions::fields_of(&name, &self.fields(&name)?).ok()? {
                if !names.contains(&inside) {
                    text += &format!("{}\nMSG: {inside}\n{}", "=".repeat(80), self.fields(&inside)?);
                    names.push(inside);
                }
            }
            next += 1;
        }
        Some(text)
    }

    fn fields(&self, name: &str) -> Option<String> {
        let usual = || USUAL.iter().find(|(usual, _)| *usual == name).map(|(_, fields)| fields.concat());
        let mut text = self.given.get(name).cloned().or_else(usual)?;
        if !text.ends_with('\n') {
            text.push('\n');
        }
        Some(text)
    }
}

/// The type that a file defines: by what stands before `=`, or by its folders.
fn named(file: &Path) -> Result<(String, PathBuf), RosBagError> {
    let text = file.to_string_lossy();
    if let Some((name, path)) = text.split_once('=') {
        return Ok((full_name(name, ""), PathBuf::from(path)));
    }
    let of = |part: Option<&Path>| Some(part?.file_name()?.to_str()?.to_owned());
    let folder = file.parent();
    let package = if of(folder).as_deref() == Some("msg") { of(folder.and_then(Path::parent)) } else { None };
    let stem = file.file_stem().and_then(|stem| stem.to_str());
    match (package, stem) {
        (Some(package), Some(stem)) => Ok((format!("{package}/{stem}"), file.to_owned())),
        _ => {
            let why = "its type is not plain from its folders; give --msg PACKAGE/TYPE=FILE".to_owned();
            Err(RosBagError::DefinitionFile { file: file.to_owned(), why })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::truth::TRUTH_TYPES;

    #[test]
    fn a_definition_holds_every_type_inside_once() {
        let known = KnownTypes::default();
        for (name, _) in USUAL {
            let text = known.definition(name).expect("all types inside are known");
            let mut types: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("MSG: ")).collect();
            let all = types.len();
            types.sort_unstable();
            types.dedup();
            assert_eq!(types.len(), all, "{name}");
            Definitions::parse(name, &text).expect("a definition");
        }
        for (name, ..) in TRUTH_TYPES {
            assert!(known.definition(name).is_some(), "{name}");
        }
        assert_eq!(known.definition("my_msgs/msg/Encoders"), None);
    }

    #[test]
    fn a_file_of_the_limit_defines_a_type_and_a_longer_one_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("long.msg");
        let given = PathBuf::from(format!("my_msgs/Long={}", file.display()));
        let mut text = "int32 a #".to_owned();
        text.push_str(&"x".repeat(MAX_DEFINITION_BYTES as usize - text.len()));
        std::fs::write(&file, &text).expect("written");
        assert!(KnownTypes::with_files(std::slice::from_ref(&given)).is_ok());
        std::fs::write(&file, text + "x").expect("written");
        let refused = KnownTypes::with_files(&[given]).expect_err("refused").to_string();
        assert!(refused.contains("longer than 1024 KiB"), "{refused}");
    }

    #[test]
    fn files_define_types_by_their_folders_or_as_said() {
        let folder = tempfile::tempdir().expect("a folder");
        let inside = folder.path().join("my_msgs/msg");
        std::fs::create_dir_all(&inside).expect("made");
        let file = inside.join("Encoders.msg");
        std::fs::write(&file, "std_msgs/Header header\nSide left\nSide right").expect("written");
        let other = folder.path().join("side.txt");
        std::fs::write(&other, "int32 count # of the encoder\n").expect("written");
        let side = PathBuf::from(format!("my_msgs/msg/Side={}", other.display()));
        let known = KnownTypes::with_files(&[file.clone(), side]).expect("definitions");
        let text = known.definition("my_msgs/msg/Encoders").expect("known");
        assert_eq!(Definitions::parse("my_msgs/msg/Encoders", &text).expect("whole").types.len(), 5);
        // Without the type inside it is not known.
        assert_eq!(KnownTypes::with_files(&[file]).expect("read").definition("my_msgs/msg/Encoders"), None);
        let message = KnownTypes::with_files(&[other]).expect_err("no folders").to_string();
        assert!(message.contains("--msg PACKAGE/TYPE=FILE"), "{message}");
    }
}
