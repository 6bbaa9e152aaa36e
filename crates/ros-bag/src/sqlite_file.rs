//! Messages of one SQLite file of rosbag2, in the order of their receipt.
//!
//! Tables by the storage plugin rosbag2_storage_sqlite3: `topics` and `messages`, and since ROS 2 Iron
//! `message_definitions`. A file that is damaged is read as far as SQLite reads it.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use rusqlite::limits::Limit;
use rusqlite::{Connection, OpenFlags, Row};

use crate::error::RosBagError;
use crate::mcap_file::{Channel, Losses};
use crate::settings::MAX_CHUNK_BYTES;

/// Whether a file is one of SQLite, by its first bytes.
pub(crate) fn is_sqlite(path: &Path) -> bool {
    let mut start = [0; 16];
    File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok() && start == *b"SQLite format 3\0"
}

/// Visits the messages of a file: channel, time of receipt in nanoseconds, bytes.
pub(crate) fn visit(
    path: &Path,
    mut visit: impl FnMut(&Channel, u64, &[u8]) -> Result<(), RosBagError>,
    losses: &mut Losses,
) -> Result<(), RosBagError> {
    let no_bag = |error: rusqlite::Error| RosBagError::NoBag { path: path.to_owned(), why: error.to_string() };
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let file = Connection::open_with_flags(path, flags).map_err(no_bag)?;
    if let Some(name) = computed_table(&file).map_err(no_bag)? {
        let why = format!("{name} is a view or computed, where a table belongs");
        return Err(RosBagError::NoBag { path: path.to_owned(), why });
    }
    let channels = channels(&file).map_err(no_bag)?;
    let mut messages = file.prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp, id");
    let mut rows = messages
        .as_mut()
        .map_err(|error| RosBagError::NoBag { path: path.to_owned(), why: error.to_string() })?
        .query([])
        .map_err(no_bag)?;
    loop {
        let row = match rows.next() {
            Ok(Some(row)) => row,
            Ok(None) => return Ok(()),
            Err(error) => {
                losses.add(format!("{}: {error}; everything before was read", path.display()));
                return Ok(());
            }
        };
        let message = |row: &Row<'_>| -> rusqlite::Result<(i64, u64, Vec<u8>)> {
            // Times are signed in SQLite; none is before 1970.
            let log_time_ns = u64::try_from(row.get::<_, i64>(1)?).unwrap_or(0);
            Ok((row.get(0)?, log_time_ns, row.get_ref(2)?.as_bytes()?.to_vec()))
        };
        match message(row) {
            Ok((topic, log_time_ns, bytes)) => match channels.get(&topic) {
                Some(channel) => visit(channel, log_time_ns, &bytes)?,
                None => losses.add(format!("{}: a message of topic {topic}, which is not declared", path.display())),
            },
            Err(error) => losses.add(format!("{}: a message could not be read: {error}", path.display())),
        }
    }
}

/// What only looks like a table of a bag: a view or a virtual table may make rows without end.
fn computed_table(file: &Connection) -> rusqlite::Result<Option<String>> {
    file.pragma_update(None, "trusted_schema", false)?;
    file.pragma_update(None, "cell_size_check", true)?;
    file.set_limit(Limit::SQLITE_LIMIT_LENGTH, MAX_CHUNK_BYTES as i32)?;
    let mut objects = file.prepare(
        "SELECT name FROM sqlite_schema WHERE name IN ('topics', 'messages', 'message_definitions') \
         AND (type <> 'table' OR sql LIKE 'CREATE VIRTUAL%' OR sql LIKE '%GENERATED ALWAYS%')",
    )?;
    let mut rows = objects.query([])?;
    rows.next()?.map(|row| row.get(0)).transpose()
}

fn channels(file: &Connection) -> rusqlite::Result<BTreeMap<i64, Channel>> {
    let mut definitions: BTreeMap<String, (String, String)> = BTreeMap::new();
    // Not there in bags of Humble and before.
    if let Ok(mut known) =
        file.prepare("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")
    {
        let rows = known.query_map([], |row| Ok((row.get(0)?, (row.get(1)?, row.get(2)?))))?;
        definitions.extend(rows.filter_map(Result::ok));
    }
    let mut topics = file.prepare("SELECT id, name, type, serialization_format FROM topics")?;
    let rows = topics.query_map([], |row| {
        let type_name: String = row.get(2)?;
        let (schema_encoding, definition) = definitions.get(&type_name).cloned().unwrap_or_default();
        let channel =
            Channel { topic: row.get(1)?, type_name, message_encoding: row.get(3)?, schema_encoding, definition };
        Ok((row.get(0)?, channel))
    })?;
    rows.collect()
}
