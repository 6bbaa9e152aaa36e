//! Which files a bag is: one file of ROS 2 or ROS 1, or a folder of rosbag2 with its `metadata.yaml`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use yaml_rust2::{Yaml, YamlLoader};

use crate::decompress::{decompress, expansion_limit_bytes};
use crate::error::RosBagError;
use crate::known_types::KnownTypes;
use crate::mcap_file::{self, Channel, Losses, expands_beyond};
use crate::ros1_file;
use crate::settings::MAX_METADATA_BYTES;
use crate::sqlite_file;
use crate::yaml_size::expanded_nodes;

/// A bag's files in order.
pub(crate) struct Bag {
    pub(crate) path: PathBuf,
    files: Vec<PathBuf>,
    /// Whether each message is compressed by itself.
    has_compressed_messages: bool,
    /// What should be known of the folder.
    remarks: Vec<String>,
    /// Types that the bag itself does not define.
    known_types: KnownTypes,
}

impl Bag {
    /// Opens a bag; `definitions` are files of types that it does not define.
    pub(crate) fn open(path: &Path, definitions: &[PathBuf]) -> Result<Self, RosBagError> {
        let known_types = KnownTypes::with_files(definitions)?;
        let bag = |files, has_compressed_messages, remarks| Self {
            path: path.to_owned(),
            files,
            has_compressed_messages,
            remarks,
            known_types,
        };
        if !path.is_dir() {
            return match path.exists() {
                false => Err(no_bag(path, "no such file or folder")),
                true => Ok(bag(vec![path.to_owned()], false, Vec::new())),
            };
        }
        let metadata = path.join("metadata.yaml");
        refuse_link_outside(path, &metadata)?;
        if !metadata.exists() {
            // A recorder that was killed has written none.
            let files = files_of(path)?;
            files.iter().try_for_each(|file| refuse_link_outside(path, file))?;
            let count = files.len();
            let remark = format!(
                "{}: no metadata.yaml; its {count} files were read as one bag, in the order of their names",
                path.display()
            );
            return match count {
                0 => Err(no_bag(path, "no metadata.yaml and no file of a bag in it")),
                1 => Ok(bag(files, false, Vec::new())),
                _ => Ok(bag(files, false, vec![remark])),
            };
        }
        let found = Metadata::read(&metadata)?;
        let named = found.files.iter().map(|name| path.join(Path::new(name).file_name().unwrap_or_default()));
        let (files, missing): (Vec<PathBuf>, Vec<PathBuf>) = named.partition(|file| file.is_file());
        files.iter().try_for_each(|file| refuse_link_outside(path, file))?;
        if files.is_empty() {
            let why = format!("none of its files is there: {}", found.files.join(", "));
            return Err(RosBagError::Metadata { file: metadata, why });
        }
        let remark = |file: &PathBuf| format!("{}: metadata.yaml names it, and it is not there", file.display());
        let remarks = missing.iter().map(remark).collect();
        Ok(bag(files, found.has_compressed_messages, remarks))
    }

    /// Whether it is one of ROS 1.
    pub(crate) fn is_ros1(&self) -> bool {
        self.files.first().is_some_and(|file| ros1_file::is_ros1(file))
    }

    /// Visits all messages in the order of the files; gives what was lost.
    pub(crate) fn visit(
        &self,
        mut visit: impl FnMut(&Channel, u64, &[u8]) -> Result<(), RosBagError>,
    ) -> Result<Losses, RosBagError> {
        let mut losses = Losses::default();
        for remark in &self.remarks {
            losses.add(remark.clone());
        }
        let mut defined: BTreeMap<String, Channel> = BTreeMap::new();
        let mut visit = |channel: &Channel, log_time_ns: u64, message: &[u8]| {
            if channel.is_defined() || channel.message_encoding != "cdr" {
                return visit(channel, log_time_ns, message);
            }
            let whole = defined.entry(channel.topic.clone()).or_insert_with(|| self.defined(channel));
            visit(whole, log_time_ns, message)
        };
        for file in &self.files {
            let limit_bytes = expansion_limit_bytes(fs::metadata(file).map_or(0, |metadata| metadata.len()));
            if !self.has_compressed_messages {
                visit_file(file, limit_bytes, &mut visit, &mut losses)?;
                continue;
            }
            let mut faulty = 0_u64;
            let mut expanded_bytes = 0;
            let mut decompressed = |channel: &Channel, log_time_ns: u64, message: &[u8]| {
                let whole = decompress("zstd", message);
                expanded_bytes += whole.bytes.len() as u64;
                if expanded_bytes > limit_bytes {
                    return Err(expands_beyond(file, limit_bytes));
                }
                if whole.fault.is_some() {
                    faulty += 1;
                    return Ok(());
                }
                visit(channel, log_time_ns, &whole.bytes)
            };
            visit_file(file, limit_bytes, &mut decompressed, &mut losses)?;
            if faulty > 0 {
                losses.add(format!("{}: {faulty} messages could not be decompressed", file.display()));
            }
        }
        Ok(losses)
    }

    /// A channel with the definition that its bag does not have, where that is known.
    fn defined(&self, channel: &Channel) -> Channel {
        match self.known_types.definition(&channel.type_name) {
            Some(definition) => Channel { definition, schema_encoding: "ros2msg".to_owned(), ..channel.clone() },
            None => channel.clone(),
        }
    }
}

/// What visits messages: channel, time of receipt in nanoseconds, bytes.
type Visit<'v> = &'v mut dyn FnMut(&Channel, u64, &[u8]) -> Result<(), RosBagError>;

fn visit_file(file: &Path, limit_bytes: u64, visit: Visit<'_>, losses: &mut Losses) -> Result<(), RosBagError> {
    if ros1_file::is_ros1(file) {
        return ros1_file::visit(file, limit_bytes, visit, losses);
    }
    if sqlite_file::is_sqlite(file) {
        return sqlite_file::visit(file, visit, losses);
    }
    mcap_file::visit(file, limit_bytes, visit, losses)
}

fn no_bag(path: &Path, why: &str) -> RosBagError {
    RosBagError::NoBag { path: path.to_owned(), why: why.to_owned() }
}

/// A bag comes from anywhere; what its folder does not hold itself is not read in its name.
fn refuse_link_outside(folder: &Path, file: &Path) -> Result<(), RosBagError> {
    let outside = atomic_file::link_outside(folder, file);
    match outside.map_err(|source| RosBagError::Io { path: folder.to_owned(), source })? {
        Some(target) => Err(RosBagError::LinkOutside { file: file.to_owned(), target }),
        None => Ok(()),
    }
}

/// The files of a folder, `bag_2.mcap` before `bag_10.mcap`.
fn files_of(folder: &Path) -> Result<Vec<PathBuf>, RosBagError> {
    let io = |source| RosBagError::Io { path: folder.to_owned(), source };
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if [".mcap", ".mcap.zstd", ".db3", ".bag"].iter().any(|end| name.ends_with(end)) {
            files.push(path);
        }
    }
    files.sort_by_cached_key(|path| (path.as_os_str().len(), path.clone()));
    Ok(files)
}

/// What matters of `metadata.yaml`.
struct Metadata {
    files: Vec<String>,
    has_compressed_messages: bool,
}

impl Metadata {
    fn read(file: &Path) -> Result<Self, RosBagError> {
        let io = |source| RosBagError::Io { path: file.to_owned(), source };
        let wrong = |why: String| RosBagError::Metadata { file: file.to_owned(), why };
        if fs::metadata(file).map_err(io)?.len() > MAX_METADATA_BYTES {
            return Err(wrong(format!("longer than {} MiB", MAX_METADATA_BYTES >> 20)));
        }
        let text = String::from_utf8_lossy(&fs::read(file).map_err(io)?).into_owned();
        expanded_nodes(&text).map_err(&wrong)?;
        let documents = YamlLoader::load_from_str(&text).map_err(|error| wrong(format!("no YAML: {error}")))?;
        let bag = documents.first().map_or(&Yaml::BadValue, |document| &document["rosbag2_bagfile_information"]);
        let files = bag["relative_file_paths"].as_vec().map_or(&[][..], Vec::as_slice);
        let files: Vec<String> = files.iter().filter_map(|name| name.as_str().map(str::to_owned)).collect();
        if files.is_empty() {
            return Err(wrong("no rosbag2_bagfile_information with relative_file_paths".to_owned()));
        }
        let is_message = bag["compression_mode"].as_str().is_some_and(|mode| mode.eq_ignore_ascii_case("message"));
        let format = bag["compression_format"].as_str().unwrap_or_default().to_owned();
        if is_message && !format.is_empty() && format != "zstd" {
            return Err(wrong(format!("messages compressed as {format:?}; zstd is read")));
        }
        Ok(Self { files, has_compressed_messages: is_message })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, text) in files {
            fs::write(folder.path().join(name), text).expect("written");
        }
        folder
    }

    #[test]
    fn a_folder_without_metadata_is_its_files_in_order() {
        let folder = folder(&[("a_10.mcap", ""), ("a_2.mcap", ""), ("notes.txt", "")]);
        let bag = Bag::open(folder.path(), &[]).expect("a bag");
        let names: Vec<_> = bag.files.iter().map(|file| file.file_name().unwrap_or_default().to_owned()).collect();
        assert_eq!(names, ["a_2.mcap", "a_10.mcap"]);
        assert!(bag.remarks[0].contains("its 2 files were read as one bag"), "{:?}", bag.remarks);
    }

    #[test]
    fn no_path_of_metadata_leaves_the_folder_and_no_alias_multiplies() {
        let names = |text: &str| {
            let folder = folder(&[("metadata.yaml", text), ("a.mcap", "")]);
            let bag = Bag::open(folder.path(), &[])?;
            assert!(bag.files.iter().all(|file| file.parent() == Some(folder.path())), "{:?}", bag.files);
            Ok::<_, RosBagError>(bag.files.len())
        };
        let yaml = |path: &str| format!("rosbag2_bagfile_information:\n  relative_file_paths: [{path}]\n");
        assert_eq!(names(&yaml("../../elsewhere/a.mcap")).expect("a bag"), 1);
        for outside in ["/etc/passwd", "../secret.mcap", ".."] {
            assert!(names(&yaml(outside)).is_err(), "{outside}");
        }
        let mut bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n".to_owned();
        for level in 1..10 {
            bomb += &format!("a{level}: &a{level} [{}]\n", vec![format!("*a{}", level - 1); 10].join(", "));
        }
        let refused = names(&(bomb + &yaml("a.mcap"))).expect_err("10¹⁰ nodes").to_string();
        assert!(refused.contains("aliases"), "{refused}");
    }

    #[test]
    fn metadata_says_files_and_compression() {
        let yaml = |storage: &str, mode: &str| {
            format!(
                "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: {storage}\n  relative_file_paths:\n    \
                 - a.mcap\n    - gone.mcap\n  compression_format: zstd\n  compression_mode: {mode}\n"
            )
        };
        let of = |text: &str| {
            let folder = folder(&[("metadata.yaml", text), ("a.mcap", "")]);
            Bag::open(folder.path(), &[]).map(|bag| (bag.files.len(), bag.remarks.len(), bag.has_compressed_messages))
        };
        assert_eq!(of(&yaml("mcap", "MESSAGE")).expect("a bag"), (1, 1, true));
        assert_eq!(of(&yaml("mcap", "FILE")).expect("a bag"), (1, 1, false));
        assert_eq!(of(&yaml("sqlite3", "")).expect("a bag"), (1, 1, false));
        for wrong in ["", "a: [", "rosbag2_bagfile_information: 3", "- 1"] {
            assert!(matches!(of(wrong), Err(RosBagError::Metadata { .. })), "{wrong}");
        }
    }
}
