//! Messages of one SQLite file of rosbag2, in the order of their receipt.
//!
//! Tables by the storage plugin rosbag2_storage_sqlite3: `topics` and `messages`, and since ROS 2 Iron
//! `message_definitions`. A file that is damaged or cut off is read as far as its pages go.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::error::RosBagError;
use crate::mcap_file::{Channel, Losses};
use crate::settings::MAX_DECLARED_BYTES;
use crate::sqlite_pages::{Column, Pages};
use crate::sqlite_tables::{Declared, tables};

/// Tables of a bag.
const TABLES: [&str; 3] = ["topics", "messages", "message_definitions"];

/// First bytes of a journal that is still to be rolled back.
const HOT_JOURNAL: [u8; 8] = [0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7];

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
    let no_bag = |why: String| RosBagError::NoBag { path: path.to_owned(), why };
    if let Some(beside) = unfinished(path) {
        return Err(RosBagError::Unfinished { file: path.to_owned(), beside });
    }
    let mut pages = Pages::open(path).map_err(no_bag)?;
    let mut lose = |why: String| losses.add(format!("{}: {why}", path.display()));
    let tables = tables(&mut pages, &TABLES, &mut lose).map_err(no_bag)?;
    let table = |name: &str| tables.get(name).ok_or_else(|| no_bag(format!("it has no table {name}")));
    let channels =
        channels(&mut pages, table("topics")?, tables.get("message_definitions"), &mut lose).map_err(no_bag)?;
    let messages = table("messages")?;
    let place = |name: &str| messages.place(name).ok_or_else(|| no_bag(format!("its messages have no column {name}")));
    let (topic_place, data_place) = (place("topic_id")?, place("data")?);
    for (time_ns, leaf, at) in rows_by_time(&mut pages, messages, place("timestamp")?, &mut lose) {
        let read = pages.row(leaf, at).and_then(|cell| Ok((cell.row, pages.record(&cell)?)));
        let (row, record) = match read {
            Ok(read) => read,
            Err(why) => {
                lose(format!("a message could not be read: {why}"));
                continue;
            }
        };
        let of = |place| messages.column(&record, row, place);
        match (of(topic_place), of(data_place)) {
            (Some(Column::Integer(topic)), Some(Column::Bytes(bytes))) => match channels.get(&topic) {
                // Times are signed in SQLite; none is before 1970.
                Some(channel) => visit(channel, u64::try_from(time_ns).unwrap_or(0), bytes)?,
                None => lose(format!("a message of topic {topic}, which is not declared")),
            },
            _ => lose(format!("a message could not be read: row {row} has no topic or no bytes")),
        }
    }
    Ok(())
}

/// What a recorder that was killed has left beside a file, without which the file is not whole.
fn unfinished(path: &Path) -> Option<PathBuf> {
    let beside = |end: &str| {
        let mut name = path.as_os_str().to_owned();
        name.push(end);
        PathBuf::from(name)
    };
    let (log, journal) = (beside("-wal"), beside("-journal"));
    if fs::metadata(&log).is_ok_and(|metadata| metadata.len() > 0) {
        return Some(log);
    }
    let mut start = [0; HOT_JOURNAL.len()];
    let is_hot = File::open(&journal).and_then(|mut file| file.read_exact(&mut start)).is_ok() && start == HOT_JOURNAL;
    is_hot.then_some(journal)
}

/// Time of each message, its leaf and where it stands there, in the order of time.
fn rows_by_time(
    pages: &mut Pages,
    messages: &Declared,
    place: usize,
    lose: &mut impl FnMut(String),
) -> Vec<(i64, u32, u16)> {
    let mut found = Vec::new();
    for leaf in pages.leaves(messages.root, lose) {
        let rows = match pages.rows(leaf) {
            Ok(rows) => rows,
            Err(why) => {
                lose(format!("{why}; its rows were left out"));
                continue;
            }
        };
        for cell in rows {
            let time = |record: &[u8]| match messages.column(record, cell.row, place) {
                Some(Column::Integer(time_ns)) => Ok(Some(time_ns)),
                Some(_) => Ok(None),
                None => Err(()),
            };
            // Where the message's bytes stand before its time, the time is in the chain.
            let time_ns = time(cell.start()).or_else(|()| pages.record(&cell).map(|whole| time(&whole).ok().flatten()));
            match time_ns {
                Ok(Some(time_ns)) => found.push((time_ns, leaf, cell.at)),
                Ok(None) => lose(format!("a message could not be read: row {} has no time", cell.row)),
                Err(why) => lose(format!("a message could not be read: {why}")),
            }
        }
    }
    found.sort_unstable();
    found
}

/// All rows of a small table with these columns, where it has them.
fn texts<const N: usize>(
    pages: &mut Pages,
    table: &Declared,
    names: [&str; N],
    lose: &mut impl FnMut(String),
    mut each: impl FnMut([Option<String>; N], i64, &mut dyn FnMut(String)),
) -> Result<(), String> {
    let places = names.map(|name| table.place(name));
    for leaf in pages.leaves(table.root, lose) {
        for cell in pages.rows(leaf)? {
            let record = pages.record(&cell)?;
            let text = |place: Option<usize>| match table.column(&record, cell.row, place?) {
                Some(Column::Bytes(text)) => Some(String::from_utf8_lossy(text).into_owned()),
                Some(Column::Integer(number)) => Some(number.to_string()),
                _ => None,
            };
            each(places.map(text), cell.row, lose);
        }
    }
    Ok(())
}

/// The topics that a file declares, by their ids, of [`MAX_DECLARED_BYTES`] with their definitions.
fn channels(
    pages: &mut Pages,
    topics: &Declared,
    definitions: Option<&Declared>,
    lose: &mut impl FnMut(String),
) -> Result<BTreeMap<i64, Channel>, String> {
    let mut free_bytes = MAX_DECLARED_BYTES;
    let mut has_room = |bytes: usize, lose: &mut dyn FnMut(String)| {
        let rest = free_bytes.checked_sub(bytes);
        free_bytes = rest.unwrap_or(free_bytes);
        if rest.is_none() {
            let most = MAX_DECLARED_BYTES >> 20;
            lose(format!("topics and definitions of more than {most} MiB; one was left out"));
        }
        rest.is_some()
    };
    let mut known: BTreeMap<String, (String, String)> = BTreeMap::new();
    // Not there in bags of Humble and before.
    if let Some(table) = definitions {
        let names = ["topic_type", "encoding", "encoded_message_definition"];
        texts(pages, table, names, lose, |[type_name, encoding, text], _, lose| {
            let (Some(type_name), Some(encoding), Some(text)) = (type_name, encoding, text) else { return };
            if has_room(type_name.len() + encoding.len() + text.len(), lose) {
                known.insert(type_name, (encoding, text));
            }
        })?;
    }
    let mut channels = BTreeMap::new();
    let names = ["id", "name", "type", "serialization_format"];
    texts(pages, topics, names, lose, |[id, topic, type_name, format], row, lose| {
        let id = id.and_then(|id| id.parse::<i64>().ok());
        let (Some(id), Some(topic), Some(type_name), Some(message_encoding)) = (id, topic, type_name, format) else {
            lose(format!("topic {row} has no id, name, type or format; it was left out"));
            return;
        };
        let (schema_encoding, definition) = known.get(&type_name).cloned().unwrap_or_default();
        let channel = Channel { topic, type_name, message_encoding, schema_encoding, definition };
        if has_room(channel.bytes(), lose) {
            channels.insert(id, channel);
        }
    })?;
    Ok(channels)
}

#[cfg(test)]
mod tests {
    use rusqlite::Connection;

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
        for statement in [view, computed] {
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

    /// Time, topic and bytes of every message of a file, and what was lost.
    type Messages = Vec<(u64, String, Vec<u8>)>;

    fn messages(path: &Path) -> Result<(Messages, Vec<String>), RosBagError> {
        let (mut found, mut losses) = (Vec::new(), Losses::default());
        let each = |channel: &Channel, time_ns: u64, bytes: &[u8]| {
            found.push((time_ns, channel.topic.clone(), bytes.to_vec()));
            Ok(())
        };
        visit(path, each, &mut losses)?;
        Ok((found, losses.lines()))
    }

    /// Writes messages of two topics whose bytes have every length around those of a page, the times
    /// backwards; every seventh is deleted again. Gives those that are left, in the order of time.
    fn write(path: &Path, settings: &str, columns: &str, page_bytes: usize) -> Messages {
        const ROWS: usize = 600;
        let file = Connection::open(path).expect("made");
        let topics = "INSERT INTO topics VALUES(1, '/a', 'T', 'cdr'), (200, '/b', 'T', 'cdr');";
        let table = format!("CREATE TABLE messages({columns});BEGIN;");
        file.execute_batch(&[settings, TOPICS, topics, &table].concat()).expect("made");
        let mut left = Vec::new();
        for row in 0..ROWS {
            let length = if row % 50 == 0 { 3 * page_bytes + row } else { row * 37 % (page_bytes + 100) };
            let bytes: Vec<u8> = (0..length).map(|place| (31 * row + place + place / 256) as u8).collect();
            let (topic, name) = if row % 3 == 0 { (200, "/b") } else { (1, "/a") };
            let time_ns = 1_700_000_000_000_000_000 - row as i64 * 1000;
            let insert = "INSERT INTO messages(topic_id, timestamp, data) VALUES(?1, ?2, ?3)";
            file.execute(insert, rusqlite::params![topic, time_ns, bytes]).expect("written");
            if row % 7 != 6 {
                left.push((time_ns as u64, name.to_owned(), bytes));
            }
        }
        file.execute_batch(
            "DELETE FROM messages WHERE id % 7 = 0; CREATE INDEX t ON messages (timestamp ASC); COMMIT;",
        )
        .expect("written");
        left.reverse();
        left
    }

    #[test]
    fn every_message_that_sqlite_wrote_is_read_back() {
        let folder = tempfile::tempdir().expect("a folder");
        let usual = "id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL";
        let bytes_first =
            "data BLOB, id INTEGER PRIMARY KEY AUTOINCREMENT, more TEXT, topic_id INTEGER, timestamp INTEGER";
        for (page_bytes, vacuum, columns) in
            [(512, "NONE", usual), (4096, "FULL", usual), (65536, "NONE", usual), (1024, "INCREMENTAL", bytes_first)]
        {
            let path = folder.path().join(format!("{page_bytes}.db3"));
            let settings = format!("PRAGMA page_size = {page_bytes}; PRAGMA auto_vacuum = {vacuum};");
            let written = write(&path, &settings, columns, page_bytes);
            let (found, lost) = messages(&path).expect("a bag");
            assert!(
                found == written && lost.is_empty(),
                "{page_bytes}: {} of {}: {lost:?}",
                found.len(),
                written.len()
            );
        }
    }

    #[test]
    fn a_log_that_is_not_yet_in_the_file_is_refused_until_sqlite_has_written_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let (path, copy) = (folder.path().join("a.db3"), folder.path().join("b.db3"));
        let open = Connection::open(&path).expect("made");
        let rows = "INSERT INTO topics VALUES(1, '/a', 'T', 'cdr'); INSERT INTO messages VALUES(1, 1, 30, x'00');";
        let settings = "PRAGMA journal_mode = WAL; PRAGMA wal_autocheckpoint = 0;";
        open.execute_batch(&[settings, TOPICS, MESSAGES, rows].concat()).expect("written");
        // A recorder that was killed: its files as they are while it runs.
        for end in ["", "-wal"] {
            let of = |path: &Path| PathBuf::from(format!("{}{end}", path.display()));
            fs::copy(of(&path), of(&copy)).expect("copied");
        }
        let refused = messages(&copy).expect_err("refused").to_string();
        assert!(
            refused.contains("b.db3-wal holds what its recorder") && refused.contains("integrity_check"),
            "{refused}"
        );
        let file = Connection::open(&copy).expect("opened");
        file.query_row("PRAGMA integrity_check", [], |_| Ok(())).expect("checked");
        drop(file);
        let (found, lost) = messages(&copy).expect("a bag");
        assert_eq!((found, lost), (vec![(30, "/a".to_owned(), vec![0])], Vec::new()));
    }

    #[test]
    fn of_a_file_that_is_cut_off_or_points_in_circles_the_rest_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.db3");
        let columns = "id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB";
        let written = write(&path, "PRAGMA page_size = 512;", columns, 512);
        let whole = fs::read(&path).expect("read");
        let of = |bytes: &[u8]| {
            fs::write(&path, bytes).expect("written");
            let (found, lost) = messages(&path).expect("a bag");
            assert!(found.iter().all(|message| written.contains(message)), "a message that nobody wrote");
            (found.len(), lost.join("\n"))
        };
        let (found, lost) = of(&whole[..whole.len() / 2 / 512 * 512]);
        assert!(found > 50 && found < written.len() && lost.contains("everything before was read"), "{found}: {lost}");
        // The first interior page that is no root names its own last child first.
        let is_interior = |page: &usize| whole[page * 512] == 5;
        let pages: Vec<usize> = (1..whole.len() / 512).filter(is_interior).collect();
        let mut circle = whole.clone();
        let page = 512 * pages[pages.len() - 1];
        let cell = usize::from(u16::from_be_bytes([whole[page + 12], whole[page + 13]]));
        circle.copy_within(page + 8..page + 12, page + cell);
        let (found, lost) = of(&circle);
        assert!(found > 50 && found < written.len() && lost.contains("occurs twice"), "{found}: {lost}");
    }
}
