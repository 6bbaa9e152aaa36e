//! Files that are malformed or say something else than they mean, each way to spoil them by itself, in a
//! table:
//! `calibrate` refuses them with what, where and what to do, or gives the right numbers.

use std::fs;
use std::path::Path;

use crate::good_log::{calibrated, good, right};

/// What is wanted of a spoiled log.
enum Wanted {
    /// The numbers of the good log, and no word.
    Right,
    /// No numbers; the message has all of these.
    Refused(&'static [&'static str]),
}
use Wanted::{Refused, Right};

/// Changes the text of a file.
fn edit(file: &Path, change: impl Fn(String) -> String) {
    let text = fs::read_to_string(file).expect("there");
    fs::write(file, change(text)).expect("written");
}

/// The text with a cell changed: of a line, counted from 1, and a column, counted from 0.
fn cell(text: &str, line: usize, column: usize, value: &str) -> String {
    let change = |(number, old): (usize, &str)| {
        let mut cells: Vec<&str> = old.split(',').collect();
        if number + 1 == line {
            cells[column] = value;
        }
        cells.join(",") + "\n"
    };
    text.lines().enumerate().map(change).collect()
}

/// The text with every cell of a column changed, the header left.
fn column(text: &str, column: usize, change: impl Fn(&str) -> String) -> String {
    let row = |(number, old): (usize, &str)| {
        let mut cells: Vec<String> = old.split(',').map(str::to_owned).collect();
        if number > 0 {
            cells[column] = change(&cells[column]);
        }
        cells.join(",") + "\n"
    };
    text.lines().enumerate().map(row).collect()
}

fn lines(text: &str, number: usize) -> String {
    text.lines().take(number).map(|line| format!("{line}\n")).collect()
}

pub(crate) type Spoil = fn(&Path);

/// The name of each way, and what does it.
pub(crate) fn ways() -> impl Iterator<Item = (&'static str, Spoil)> {
    TABLE.iter().map(|(name, spoil, _)| (*name, *spoil))
}

const TABLE: &[(&str, Spoil, Wanted)] = &[
    ("nothing", |_| (), Right),
    ("no odometry.csv", |at| fs::remove_file(at.join("odometry.csv")).expect("removed"), Refused(&["odometry.csv"])),
    ("no truth.csv", |at| fs::remove_file(at.join("truth.csv")).expect("removed"), Refused(&["truth"])),
    ("an empty file", |at| edit(&at.join("odometry.csv"), |_| String::new()), Refused(&["odometry.csv", "empty"])),
    ("a header alone", |at| edit(&at.join("odometry.csv"), |t| lines(&t, 1)), Refused(&["odometry.csv"])),
    ("one row", |at| edit(&at.join("odometry.csv"), |t| lines(&t, 2)), Refused(&["odometry.csv"])),
    ("NaN", |at| edit(&at.join("odometry.csv"), |t| cell(&t, 9, 2, "NaN")), Refused(&["odometry.csv:9", "left_ticks"])),
    ("infinity", |at| edit(&at.join("truth.csv"), |t| cell(&t, 9, 2, "inf")), Refused(&["truth.csv:9", "x_m"])),
    ("text", |at| edit(&at.join("truth.csv"), |t| cell(&t, 9, 3, "n/a")), Refused(&["truth.csv:9", "y_m", "n/a"])),
    ("a time twice", |at| edit(&at.join("odometry.csv"), |t| cell(&t, 9, 1, "0.1200")), Refused(&["odometry.csv:9"])),
    ("time backwards", |at| edit(&at.join("truth.csv"), |t| cell(&t, 9, 1, "0.0100")), Refused(&["truth.csv:9"])),
    (
        "other names",
        |at| edit(&at.join("odometry.csv"), |t| t.replace("left_ticks,right_ticks", "enc_l,enc_r")),
        Refused(&["odometry.csv", "enc_l", "left_ticks", "yair import csv"]),
    ),
    (
        "semicolons",
        |at| edit(&at.join("odometry.csv"), |t| t.replace(',', ";")),
        Refused(&["odometry.csv", "semicolon"]),
    ),
    ("tabs", |at| edit(&at.join("truth.csv"), |t| t.replace(',', "\t")), Refused(&["truth.csv", "tab"])),
    (
        "decimal commas",
        |at| edit(&at.join("truth.csv"), |t| t.replace(',', ";").replace('.', ",")),
        Refused(&["truth.csv:1", "semicolons"]),
    ),
    (
        "decimal commas between commas",
        |at| edit(&at.join("truth.csv"), |t| column(&t, 2, |cell| format!("\"{}\"", cell.replace('.', ",")))),
        Refused(&["truth.csv:2", "a decimal point and no comma"]),
    ),
    (
        "a mark of UTF-8, ends of lines of Windows, spaces in the header",
        |at| {
            let header = |t: String| t.replacen("run,t_s,", "\u{feff}run, t_s ,", 1).replace('\n', "\r\n");
            edit(&at.join("odometry.csv"), header);
            edit(&at.join("truth.csv"), header);
        },
        Right,
    ),
    (
        "seconds since 1970",
        |at| {
            let since = |t: String| {
                column(&t, 1, |cell| format!("17{:0>14}", format!("{:.4}", cell.parse::<f64>().expect("a time") + 5e7)))
            };
            edit(&at.join("odometry.csv"), since);
            edit(&at.join("truth.csv"), since);
        },
        Right,
    ),
    (
        "ticks as 12.0",
        |at| {
            edit(&at.join("odometry.csv"), |t| {
                column(&column(&t, 2, |cell| format!("{cell}.0")), 3, |cell| format!("{cell}.0"))
            });
        },
        Right,
    ),
    (
        "ticks as 3.5",
        |at| edit(&at.join("odometry.csv"), |t| cell(&t, 9, 2, "3.5")),
        Refused(&["odometry.csv:9", "3.5"]),
    ),
    (
        "a count of 4e9",
        |at| edit(&at.join("odometry.csv"), |t| cell(&t, 60, 2, "4000000000")),
        Refused(&["00_straight", "spike"]),
    ),
    (
        "a count beyond all integers",
        |at| edit(&at.join("odometry.csv"), |t| cell(&t, 60, 2, "99999999999999999999")),
        Refused(&["odometry.csv:60", "left_ticks"]),
    ),
    (
        "not UTF-8",
        |at| {
            let mut bytes = fs::read(at.join("truth.csv")).expect("there");
            bytes[100] = 0xe9;
            fs::write(at.join("truth.csv"), bytes).expect("written");
        },
        Refused(&["truth.csv", "UTF-8"]),
    ),
    (
        "UTF-16",
        |at| {
            let text = fs::read_to_string(at.join("truth.csv")).expect("there");
            let units = std::iter::once(0xfeff).chain(text.encode_utf16());
            fs::write(at.join("truth.csv"), units.flat_map(u16::to_le_bytes).collect::<Vec<_>>()).expect("written");
        },
        Refused(&["truth.csv", "not UTF-8 text"]),
    ),
    (
        "cut in the last row",
        |at| edit(&at.join("truth.csv"), |t| t.trim_end().rsplit_once(',').expect("cells").0.to_owned()),
        Refused(&["truth.csv", "cut off"]),
    ),
    (
        "the settings cut",
        |at| edit(&at.join("dataset.toml"), |t| t[..t.rfind("protocol").expect("there") + 4].to_owned()),
        Refused(&["dataset.toml", "cut off at line"]),
    ),
    (
        "an unknown key",
        |at| edit(&at.join("dataset.toml"), |t| t.replace("wheel_separation_m", "wheelbase")),
        Refused(&["dataset.toml", "wheelbase"]),
    ),
    (
        "millimetres by name",
        |at| edit(&at.join("dataset.toml"), |t| t.replace("wheel_separation_m = 0.3", "wheel_separation_mm = 300")),
        Refused(&["dataset.toml", "wheel_separation_mm"]),
    ),
    (
        "radii",
        |at| {
            edit(&at.join("dataset.toml"), |t| {
                t.replace("left_wheel_diameter_m = 0.15", "left_wheel_radius_m = 0.075")
            });
        },
        Refused(&["dataset.toml", "a diameter is twice the radius"]),
    ),
    (
        "a negative separation",
        |at| edit(&at.join("dataset.toml"), |t| t.replace("wheel_separation_m = 0.3", "wheel_separation_m = -0.3")),
        Refused(&["dataset.toml", "wheel_separation_m"]),
    ),
    (
        "a wheel of nothing",
        |at| {
            edit(&at.join("dataset.toml"), |t| {
                t.replace("left_wheel_diameter_m = 0.15", "left_wheel_diameter_m = 0.0")
            });
        },
        Refused(&["dataset.toml", "left_wheel_diameter_m"]),
    ),
    (
        "a separation of 300 m",
        |at| edit(&at.join("dataset.toml"), |t| t.replace("wheel_separation_m = 0.3", "wheel_separation_m = 300")),
        Refused(&["300", "metres"]),
    ),
    (
        "no headings and no column for them",
        |at| {
            edit(&at.join("truth.csv"), |t| {
                t.lines().map(|line| format!("{}\n", line.rsplit_once(',').expect("cells").0)).collect()
            });
        },
        Refused(&["truth.csv", "theta_rad", "empty"]),
    ),
    (
        "a folder in place of a file",
        |at| {
            fs::remove_file(at.join("odometry.csv")).expect("removed");
            fs::create_dir(at.join("odometry.csv")).expect("made");
        },
        Refused(&["odometry.csv", "is a folder"]),
    ),
    (
        "a file in place of the folder",
        |at| {
            fs::remove_dir_all(at).expect("removed");
            fs::write(at, "run,t_s\n").expect("written");
        },
        Refused(&["is a file"]),
    ),
];

#[test]
fn no_spoiled_file_gives_a_wrong_number_and_exit_code_0() {
    let log = good(31);
    let mut wrong = Vec::new();
    for (name, spoil, wanted) in TABLE {
        let temp = tempfile::tempdir().expect("a temporary folder");
        log.write(&temp.path().join("set"), "");
        spoil(&temp.path().join("set"));
        let (values, message) = calibrated(temp.path(), "set");
        match (wanted, values) {
            (Right, Some(values)) if message.is_empty() => right(values),
            (Refused(parts), None) if parts.iter().all(|part| message.contains(part)) => {}
            (_, values) => wrong.push(format!("{name}: {values:?} {message}")),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
