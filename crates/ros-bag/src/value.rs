//! A message as a tree, and the paths into it: `pose.pose.position.x`, `position[0]`.

/// A decoded value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value {
    Integer(i128),
    Float(f64),
    Text(String),
    List(Vec<Value>),
    /// Fields in their order.
    Message(Vec<(String, Value)>),
}

impl Value {
    /// What stands at a path; parts are separated by dots, elements of a list are `[0]` or a part of digits.
    pub(crate) fn at(&self, path: &str) -> Option<&Self> {
        path.split(['.', '[']).filter(|part| !part.is_empty()).try_fold(self, |value, part| {
            let part = part.strip_suffix(']').unwrap_or(part);
            match value {
                Self::Message(fields) => fields.iter().find(|(name, _)| name == part).map(|(_, value)| value),
                Self::List(values) => values.get(part.parse::<usize>().ok()?),
                _ => None,
            }
        })
    }

    /// The number at a path; integers beyond 2⁵³ lose their last digits.
    pub(crate) fn number(&self, path: &str) -> Option<f64> {
        match self.at(path)? {
            Self::Integer(value) => Some(*value as f64),
            Self::Float(value) => Some(*value),
            _ => None,
        }
    }

    /// The integer at a path.
    pub(crate) fn integer(&self, path: &str) -> Option<i128> {
        match self.at(path)? {
            Self::Integer(value) => Some(*value),
            _ => None,
        }
    }

    /// The text at a path.
    pub(crate) fn text(&self, path: &str) -> Option<&str> {
        match self.at(path)? {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    /// The elements of the list at a path; none where there is no list.
    pub(crate) fn list(&self, path: &str) -> &[Self] {
        match self.at(path) {
            Some(Self::List(values)) => values,
            _ => &[],
        }
    }

    /// All texts of the list at a path.
    pub(crate) fn texts(&self, path: &str) -> Vec<&str> {
        self.list(path).iter().filter_map(|value| value.text("")).collect()
    }

    /// Paths of all numbers, lists by their first element; at most a dozen, for messages.
    pub(crate) fn paths_of_numbers(&self) -> Vec<String> {
        let mut paths = Vec::new();
        self.collect_paths("", &mut paths);
        // The stamp is in most messages, and never what is looked for.
        paths.retain(|path| !path.starts_with("header."));
        paths.truncate(12);
        paths
    }

    fn collect_paths(&self, at: &str, paths: &mut Vec<String>) {
        match self {
            Self::Integer(_) | Self::Float(_) => paths.push(at.to_owned()),
            Self::Text(_) => {}
            Self::List(values) => {
                if let Some(first) = values.first() {
                    first.collect_paths(&format!("{at}[0]"), paths);
                }
            }
            Self::Message(fields) => {
                for (name, value) in fields {
                    let path = if at.is_empty() { name.clone() } else { format!("{at}.{name}") };
                    value.collect_paths(&path, paths);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_go_through_messages_and_lists() {
        let message = |fields: &[(&str, Value)]| {
            Value::Message(fields.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect())
        };
        let inner =
            message(&[("x", Value::Float(1.5)), ("ids", Value::List(vec![Value::Integer(7), Value::Integer(-8)]))]);
        let value = message(&[("pose", inner), ("name", Value::Text("left".to_owned()))]);
        assert_eq!(value.number("pose.x"), Some(1.5));
        assert_eq!((value.integer("pose.ids[1]"), value.integer("pose.ids.0")), (Some(-8), Some(7)));
        assert_eq!(value.text("name"), Some("left"));
        for wrong in ["pose.y", "pose.ids[2]", "pose.ids.x", "name.x", "pose"] {
            assert_eq!(value.number(wrong), None, "{wrong}");
        }
        assert_eq!(value.paths_of_numbers(), ["pose.x", "pose.ids[0]"]);
    }
}
