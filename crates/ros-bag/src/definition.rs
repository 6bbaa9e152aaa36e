//! Message definitions in ROS 2's own language (`ros2msg`), as MCAP files carry them.
//!
//! A schema holds the definition of its type, and after a line of `=` and one of `MSG: package/Type` that of
//! each type inside. Constants and defaults are not in a message and are left out here.
//! Reference: MCAP specification, registry of well-known formats, "ros2msg";
//! <https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html>.

use std::collections::BTreeMap;

use crate::settings::{MAX_FIELDS, MAX_TYPES};

/// What a field holds, one element of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Signed integer of so many bytes.
    Signed(usize),
    /// Unsigned integer of so many bytes; bool, byte and char too.
    Unsigned(usize),
    Float32,
    Float64,
    Text,
    /// Another type, by its full name.
    Nested(String),
}

/// How many elements a field holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Arity {
    One,
    Array(usize),
    /// Any number, bounded or not.
    Sequence,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) arity: Arity,
}

/// How a message's values follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wire {
    /// ROS 2: CDR.
    Cdr,
    /// ROS 1: one behind the other.
    Ros1,
}

/// A type and all types inside it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Definitions {
    pub(crate) wire: Wire,
    pub(crate) root: String,
    pub(crate) types: BTreeMap<String, Vec<Field>>,
}

impl Definitions {
    /// Reads a schema's text, which is in the same language in ROS 1; an error says what and in which line of
    /// it.
    pub(crate) fn parse(root: &str, text: &str) -> Result<Self, String> {
        let root = full_name(root, "");
        let (mut types, mut name, mut fields) = (BTreeMap::new(), root.clone(), Vec::new());
        let mut is_separated = false;
        for (number, line) in (1..).zip(text.lines()) {
            let line = line.trim();
            if line.len() >= 3 && line.bytes().all(|byte| byte == b'=') {
                types.insert(std::mem::take(&mut name), std::mem::take(&mut fields));
                is_separated = true;
            } else if let Some(next) = line.strip_prefix("MSG:") {
                name = full_name(next.trim(), "");
                is_separated = false;
            } else if line.starts_with("IDL:") {
                return Err("it is defined in IDL (ros2idl), which is not read here".to_owned());
            } else if is_separated && !line.is_empty() {
                return Err(format!("definition, line {number}: expected \"MSG: package/Type\" after a line of ="));
            } else if let Some(field) = field(line, &name).map_err(|why| format!("definition, line {number}: {why}"))? {
                fields.push(field);
            }
            if types.len() > MAX_TYPES || fields.len() > MAX_FIELDS {
                return Err(format!("definition, line {number}: more than {MAX_TYPES} types or {MAX_FIELDS} fields"));
            }
        }
        if !is_separated {
            types.insert(name, fields);
        }
        for name in ["builtin_interfaces/Time", "builtin_interfaces/Duration"] {
            types.entry(name.to_owned()).or_insert_with(|| {
                let of = |name: &str, kind| Field { name: name.to_owned(), kind, arity: Arity::One };
                vec![of("sec", Kind::Signed(4)), of("nanosec", Kind::Unsigned(4))]
            });
        }
        for (name, fields) in &types {
            for field in fields {
                if let Kind::Nested(inner) = &field.kind
                    && !types.contains_key(inner)
                {
                    return Err(format!("{name} has a field {} of {inner}, whose definition is missing", field.name));
                }
            }
        }
        Ok(Self { wire: Wire::Cdr, root, types })
    }

    /// Full names of the types of a type's own fields; an error says what is wrong in which line.
    pub(crate) fn fields_of(name: &str, text: &str) -> Result<Vec<String>, String> {
        let mut names = Vec::new();
        for (number, line) in (1..).zip(text.lines()) {
            let found = field(line.trim(), name).map_err(|why| format!("line {number}: {why}"))?;
            if let Some(Field { kind: Kind::Nested(inside), .. }) = found {
                names.push(inside);
            }
        }
        Ok(names)
    }
}

/// `package/Type`, however it is written: with `msg` in between, or without the package inside of one.
pub(crate) fn full_name(name: &str, inside: &str) -> String {
    let parts: Vec<&str> = name.split('/').collect();
    match parts[..] {
        [package, _, name] => format!("{package}/{name}"),
        ["Header"] => "std_msgs/Header".to_owned(),
        ["time"] => "builtin_interfaces/Time".to_owned(),
        ["duration"] => "builtin_interfaces/Duration".to_owned(),
        [name] => match inside.split_once('/') {
            Some((package, _)) => format!("{package}/{name}"),
            None => name.to_owned(),
        },
        _ => name.to_owned(),
    }
}

/// What ROS 2 calls a type of ROS 1: `package/msg/Type`.
pub(crate) fn ros2_name(name: &str) -> String {
    match name.split_once('/') {
        Some(("tf", "tfMessage")) => "tf2_msgs/msg/TFMessage".to_owned(),
        Some((package, name)) if !name.contains('/') => format!("{package}/msg/{name}"),
        _ => name.to_owned(),
    }
}

/// The field that a line declares, if it declares one.
fn field(line: &str, inside: &str) -> Result<Option<Field>, String> {
    let line = if line.starts_with('#') { "" } else { line };
    let Some((type_name, rest)) = line.split_once(char::is_whitespace) else {
        return if line.is_empty() {
            Ok(None)
        } else {
            Err(format!("expected a type and a name, found {:?}", clip(line)))
        };
    };
    let rest = rest.trim_start();
    let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
    let (name, after) = rest.split_at(end);
    if name.is_empty() {
        return Err(format!("expected a name after {:?}", clip(type_name)));
    }
    // What follows the name is a constant's value, a default or a comment.
    if after.trim_start().starts_with('=') {
        return Ok(None);
    }
    let (element, arity) = match type_name.strip_suffix(']').and_then(|inner| inner.rsplit_once('[')) {
        None => (type_name, Arity::One),
        Some((element, "")) => (element, Arity::Sequence),
        Some((element, bound)) => match (bound.strip_prefix("<="), bound.parse()) {
            (Some(_), _) => (element, Arity::Sequence),
            (None, Ok(length)) if length > 0 => (element, Arity::Array(length)),
            (None, _) => return Err(format!("expected a length in {:?}", clip(type_name))),
        },
    };
    let kind = match element.split_once("<=").map_or(element, |(element, _)| element) {
        "bool" | "byte" | "char" | "uint8" => Kind::Unsigned(1),
        "uint16" => Kind::Unsigned(2),
        "uint32" => Kind::Unsigned(4),
        "uint64" => Kind::Unsigned(8),
        "int8" => Kind::Signed(1),
        "int16" => Kind::Signed(2),
        "int32" => Kind::Signed(4),
        "int64" => Kind::Signed(8),
        "float32" => Kind::Float32,
        "float64" => Kind::Float64,
        "string" => Kind::Text,
        "wstring" => return Err("wide strings (wstring) are not read here".to_owned()),
        other => Kind::Nested(full_name(other, inside)),
    };
    Ok(Some(Field { name: name.to_owned(), kind, arity }))
}

fn clip(text: &str) -> String {
    text.chars().take(40).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_defaults_comments_and_bounds_are_told_from_fields() {
        let text = "# a comment\nuint8 LEFT=1\nstring GREETING = \"a # b\"\nstd_msgs/Header header # stamped\n\
                    string<=10 label \"none\"\nint32[<=5] few\nfloat64[36] covariance\nfloat32[] ranges\nInner[2] pair\n\
                    uint16 count 7\n===\nMSG: my_msgs/Inner\nbool on\n===\nMSG: std_msgs/Header\n\
                    builtin_interfaces/Time stamp\nstring frame_id\n";
        let found = Definitions::parse("my_msgs/msg/Outer", text).expect("a definition");
        let fields: Vec<(&str, Arity)> =
            found.types["my_msgs/Outer"].iter().map(|field| (&field.name[..], field.arity)).collect();
        assert_eq!(
            fields,
            [
                ("header", Arity::One),
                ("label", Arity::One),
                ("few", Arity::Sequence),
                ("covariance", Arity::Array(36)),
                ("ranges", Arity::Sequence),
                ("pair", Arity::Array(2)),
                ("count", Arity::One),
            ]
        );
        assert_eq!(found.types["my_msgs/Outer"][5].kind, Kind::Nested("my_msgs/Inner".to_owned()));
        assert_eq!(found.types["builtin_interfaces/Time"].len(), 2);
    }

    #[test]
    fn types_of_ros_1_have_the_names_of_ros_2() {
        let names = ["std_msgs/Int32", "tf/tfMessage", "nav_msgs/msg/Odometry", "Odd"].map(ros2_name);
        assert_eq!(names, ["std_msgs/msg/Int32", "tf2_msgs/msg/TFMessage", "nav_msgs/msg/Odometry", "Odd"]);
    }

    #[test]
    fn what_is_no_definition_is_refused_with_its_line() {
        let refused = |text: &str| Definitions::parse("a/msg/B", text).expect_err("refused");
        assert!(refused("int32 a\nint32\n").contains("line 2: expected a type and a name"));
        assert!(refused("int32[x] a\n").contains("expected a length"));
        assert!(refused("int32[0] a\n").contains("expected a length"));
        assert!(refused("Other a\n").contains("a/Other, whose definition is missing"));
        assert!(refused("===\nIDL: a/msg/B\n").contains("ros2idl"));
        assert!(refused("wstring a").contains("wstring"));
    }

    #[test]
    fn types_and_fields_beyond_their_limits_are_refused() {
        let fields = |count: usize| "int8 a\n".repeat(count);
        let types = |count: usize| (0..count).map(|number| format!("===\nMSG: a/T{number}\n")).collect::<String>();
        let parse = |text: &str| Definitions::parse("a/msg/B", text);
        // The root is a type too.
        assert!(parse(&fields(MAX_FIELDS)).is_ok() && parse(&types(MAX_TYPES)).is_ok());
        for text in [fields(MAX_FIELDS + 1), types(MAX_TYPES + 2)] {
            assert!(parse(&text).expect_err("refused").contains("more than 1000 types or 1000 fields"));
        }
    }
}
