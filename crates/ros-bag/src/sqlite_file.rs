//! Messages of one SQLite file of rosbag2, in the order of their receipt.
//!
//! Tables by the storage plugin rosbag2_storage_sqlite3: `topics` and `messages`, and since ROS 2 Iron
//! `message_definitions`. A file that is damaged is read as far as SQLite reads it.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use rusqlite::limits::Limit;
use rusqlite::{Connection, OpenFlags};

use crate::error::RosBagError;
use crate::mcap_file::{Channel, Losses};
use crate::settings::{MAX_CHUNK_BYTES, MAX_DECLARED_BYTES, MIN_SQLITE_ROW_BYTES};

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
    let file_bytes = std::fs::metadata(path).map_or(0, |metadata| metadata.len());
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let file = Connection::open_with_flags(path, flags).map_err(no_bag)?;
    if let Some(name) = computed_table(&file).map_err(no_bag)? {
        let why = format!("{name} is a view or computed, where a table belongs");
        return Err(RosBagError::NoBag { path: path.to_owned(), why });
    }
    let mut lose = |why: String| losses.add(format!("{}: {why}", path.display()));
    let channels = channels(&file, &mut lose).map_err(no_bag)?;
    let rows = rows_by_time(&file, file_bytes / MIN_SQLITE_ROW_BYTES, &mut lose).map_err(no_bag)?;
    let mut message = file.prepare("SELECT topic_id, data FROM messages WHERE _rowid_ = ?1").map_err(no_bag)?;
    for (time_ns, row) in rows {
        let found = message.query_row([row], |row| Ok((row.get::<_, i64>(0)?, row.get_ref(1)?.as_bytes()?.to_vec())));
        match found {
            Ok((topic, bytes)) => match channels.get(&topic) {
                // Times are signed in SQLite; none is before 1970.
                Some(channel) => visit(channel, u64::try_from(time_ns).unwrap_or(0), &bytes)?,
                None => lose(format!("a message of topic {topic}, which is not declared")),
            },
            Err(error) => lose(format!("a message could not be read: {error}")),
        }
    }
    Ok(())
}

/// Times and rows of the messages in the order of time. SQLite sorts nothing, because it would copy every
/// message; and pages that point to each other in circles have rows without end, so that no more rows are
/// read than the file has room for.
fn rows_by_time(file: &Connection, most: u64, lose: &mut impl FnMut(String)) -> rusqlite::Result<Vec<(i64, i64)>> {
    let mut messages = file.prepare("SELECT timestamp, _rowid_ FROM messages")?;
    let mut rows = messages.query([])?;
    let mut found = Vec::new();
    loop {
        match rows.next() {
            Ok(Some(_)) if found.len() as u64 >= most => {
                lose(format!("more than {most} messages, for which the file has no room; the rest was left out"));
                break;
            }
            Ok(Some(row)) => match (row.get(0), row.get(1)) {
                (Ok(time_ns), Ok(row)) => found.push((time_ns, row)),
                (Err(error), _) | (_, Err(error)) => lose(format!("a message could not be read: {error}")),
            },
            Ok(None) => break,
            Err(error) => {
                lose(format!("{error}; everything before was read"));
                break;
            }
        }
    }
    found.sort_unstable();
    Ok(found)
}

/// What only looks like a table of a bag: a view, a virtual table or a computed column may make rows and
/// bytes without end. Names differ by no case in SQLite.
fn computed_table(file: &Connection) -> rusqlite::Result<Option<String>> {
    file.pragma_update(None, "trusted_schema", false)?;
    file.pragma_update(None, "cell_size_check", true)?;
    file.set_limit(Limit::SQLITE_LIMIT_LENGTH, MAX_CHUNK_BYTES as i32)?;
    let mut objects = file.prepare(
        "SELECT list.name FROM pragma_table_list AS list \
         WHERE lower(list.name) IN ('topics', 'messages', 'message_definitions') AND (list.type <> 'table' OR list.wr \
         OR EXISTS (SELECT 1 FROM pragma_table_xinfo(list.name) AS field WHERE field.hidden <> 0 OR lower(field.name) = '_rowid_'))",
    )?;
    let mut rows = objects.query([])?;
    rows.next()?.map(|row| row.get(0)).transpose()
}

/// The topics that a file declares, by their ids, of [`MAX_DECLARED_BYTES`] with their definitions.
fn channels(file: &Connection, lose: &mut impl FnMut(String)) -> rusqlite::Result<BTreeMap<i64, Channel>> {
    let mut free_bytes = MAX_DECLARED_BYTES;
    let mut has_room = |bytes: usize| {
        let rest = free_bytes.checked_sub(bytes);
        free_bytes = rest.unwrap_or(free_bytes);
        if rest.is_none() {
            let most = MAX_DECLARED_BYTES >> 20;
            lose(format!("topics and definitions of more than {most} MiB; one was left out"));
        }
        rest.is_some()
    };
    let mut definitions: BTreeMap<String, (String, String)> = BTreeMap::new();
    // Not there in bags of Humble and before.
    if let Ok(mut known) =
        file.prepare("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")
    {
        let rows = known.query_map([], |row| Ok((row.get(0)?, (row.get(1)?, row.get(2)?))))?;
        for (type_name, definition) in rows.filter_map(Result::ok) {
            let (type_name, definition): (String, (String, String)) = (type_name, definition);
            if has_room(type_name.len() + definition.0.len() + definition.1.len()) {
                definitions.insert(type_name, definition);
            }
        }
    }
    let mut topics = file.prepare("SELECT id, name, type, serialization_format FROM topics")?;
    let mut rows = topics.query([])?;
    let mut channels = BTreeMap::new();
    while let Some(row) = rows.next()? {
        let type_name: String = row.get(2)?;
        let (schema_encoding, definition) = definitions.get(&type_name).cloned().unwrap_or_default();
        let channel =
            Channel { topic: row.get(1)?, type_name, message_encoding: row.get(3)?, schema_encoding, definition };
        if has_room(channel.bytes()) {
            channels.insert(row.get(0)?, channel);
        }
    }
    Ok(channels)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOPICS: &str =
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);";
    const MESSAGES: &str =
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);";
    const DEFINITIONS: &str =
        "CREATE TABLE message_definitions(topic_type TEXT, encoding TEXT, encoded_message_definition TEXT);";

    /// Times of the messages of a file that these statements make, and what was lost.
    fn read(statements: &[&str]) -> Result<(Vec<u64>, Vec<String>), RosBagError> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.db3");
        Connection::open(&path).and_then(|file| file.execute_batch(&statements.concat())).expect("written");
        let (mut times_ns, mut losses) = (Vec::new(), Losses::default());
        let each = |_: &Channel, time_ns: u64, _: &[u8]| {
            times_ns.push(time_ns);
            Ok(())
        };
        visit(&path, each, &mut losses)?;
        Ok((times_ns, losses.lines()))
    }

    #[test]
    fn messages_come_in_the_order_of_time_and_those_of_no_topic_are_lost() {
        let rows = "INSERT INTO topics VALUES(1, '/a', 'T', 'cdr');\
                    INSERT INTO messages VALUES(1, 1, 30, x'00'), (2, 1, 10, x'00'), (3, 2, 20, x'00'), (4, 1, 20, 'text'), (5, 1, 'x', x'00');";
        let (times_ns, lost) = read(&[TOPICS, MESSAGES, rows]).expect("a bag");
        assert_eq!((&times_ns[..], lost.len()), (&[10, 20, 30][..], 2), "{lost:?}");
    }

    #[test]
    fn what_makes_rows_or_bytes_without_end_is_refused() {
        let view = "CREATE VIEW Messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n) \
                    SELECT id, 1 AS topic_id, id AS timestamp, x'00' AS data FROM n;";
        let computed = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, \
                        data BLOB AS (zeroblob(200000000)));";
        let unordered =
            "CREATE TABLE messages(id INTEGER, _ROWID_ INTEGER, topic_id INTEGER, timestamp INTEGER, data BLOB);";
        for statement in [view, computed, unordered] {
            let refused = read(&[TOPICS, statement]).expect_err("refused").to_string();
            assert!(refused.contains("is a view or computed"), "{refused}");
        }
    }

    #[test]
    fn a_definition_that_many_topics_repeat_is_held_a_bounded_number_of_times() {
        let many = "INSERT INTO message_definitions VALUES('T', 'ros2msg', hex(zeroblob(1 << 20)));\
                    WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n WHERE id < 40) \
                    INSERT INTO topics SELECT id, '/' || id, 'T', 'cdr' FROM n;";
        let (_, lost) = read(&[TOPICS, MESSAGES, DEFINITIONS, many]).expect("a bag");
        // 2 MiB each, of 64: the definition itself and 30 topics have room with their names.
        assert!(
            lost[0].contains("more than 64 MiB") && lost.last().is_some_and(|last| last.starts_with("5 more")),
            "{lost:?}"
        );
    }

    #[test]
    fn no_more_rows_are_read_than_the_file_has_room_for() {
        let file = Connection::open_in_memory().expect("a file");
        let rows = "INSERT INTO messages(topic_id, timestamp) VALUES(1, 3), (1, 2), (1, 1);";
        file.execute_batch(&[MESSAGES, rows].concat()).expect("written");
        let mut lost = Vec::new();
        let mut of = |most: u64| rows_by_time(&file, most, &mut |why| lost.push(why)).expect("rows");
        assert_eq!((of(3), of(2)), (vec![(1, 3), (2, 2), (3, 1)], vec![(2, 2), (3, 1)]));
        assert!(matches!(&lost[..], [why] if why.contains("more than 2 messages")), "{lost:?}");
    }
}
