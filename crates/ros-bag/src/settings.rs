//! Every limit on what a bag may say of itself. Memory and time stay within them whatever the bytes claim.

/// Bytes. Longest `metadata.yaml`.
/// Budgeted: a kilobyte a topic and file, and some ten thousand of these.
pub(crate) const MAX_METADATA_BYTES: u64 = 16 << 20;

/// Nodes of `metadata.yaml` with every alias (`*name`) expanded.
/// Budgeted: some ten a topic and file, of 16 MiB without aliases.
pub(crate) const MAX_YAML_NODES: u64 = 1 << 20;

/// Bytes. Largest chunk or message, compressed or not; records beyond are left out.
/// Budgeted: recorders close a chunk at 768 KiB (rosbag2) or 1 MiB (MCAP's writers); a larger one holds one
/// message, and the largest of those are point clouds and raw images of some 100 MB.
pub(crate) const MAX_CHUNK_BYTES: u64 = 256 << 20;

/// Decompressed over compressed bytes of a file, beyond [`MIN_EXPANDED_BYTES`].
/// Budgeted: logs of wheels and poses compress 3 to 20 times; an image of one colour 1000 times.
pub(crate) const MAX_EXPANSION: u64 = 1000;

/// Bytes. A file may become so large by decompression whatever its own size.
/// Budgeted: a second or two of decompression.
pub(crate) const MIN_EXPANDED_BYTES: u64 = 1 << 30;

/// Bytes. All schemas and channels of a file together; those beyond are left out.
/// Budgeted: some ten kilobytes a topic, of some thousand topics.
pub(crate) const MAX_DECLARED_BYTES: usize = 64 << 20;

/// Places of a file at which records no longer follow each other; what stands behind the last is left out.
/// Budgeted: at each, the rest of the file may be read once more.
pub(crate) const MAX_BREAKS: usize = 100;

/// Bytes. Longest message that is decoded.
/// Budgeted: wheels and poses take some hundred bytes, the frames of a large robot some 10 kB.
pub(crate) const MAX_MESSAGE_BYTES: usize = 4 << 20;

/// Numbers, texts, lists and messages in one decoded message.
/// Budgeted: a scan of a laser has some ten thousand; decoded, a value takes up to 100 bytes.
pub(crate) const MAX_VALUES: usize = 1 << 20;

/// Levels of types inside of types; a type that holds itself would go on for ever.
/// Budgeted: standard messages reach 6.
pub(crate) const MAX_DEPTH: usize = 32;

/// Types in one definition.
/// Budgeted: the largest in use hold some dozens.
pub(crate) const MAX_TYPES: usize = 1000;

/// Fields of one type.
/// Budgeted: the largest in use hold some dozens.
pub(crate) const MAX_FIELDS: usize = 1000;

/// Bytes. Longest file of a type's definition, as `--msg` takes it.
/// Budgeted: a kilobyte is usual.
pub(crate) const MAX_DEFINITION_BYTES: u64 = 1 << 20;

/// Faults of a file that are told one by one; more are counted.
/// Convention: a screen holds them.
pub(crate) const MAX_REPORTED: usize = 5;
