//! Points and lines over an axis: the data for the script, and the same as a table.

use serde_json::{Value, json};

use crate::embedded_json::embedded;
use crate::numbers::{self, shown};
use crate::role::Role;
use crate::table::{Cell, Table};

/// An axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// What is along it.
    pub label: String,
    /// Its unit; empty for a number.
    pub unit: String,
    /// Whether values are spread by their logarithm; all are positive then.
    pub log: bool,
}

impl Axis {
    /// An axis.
    #[must_use]
    pub fn new(label: &str, unit: &str) -> Self {
        Self { label: label.to_owned(), unit: unit.to_owned(), log: false }
    }

    /// The same, logarithmic.
    #[must_use]
    pub fn logarithmic(self, log: bool) -> Self {
        Self { log, ..self }
    }

    fn text(&self) -> String {
        if self.unit.is_empty() { self.label.clone() } else { format!("{}, {}", self.label, self.unit) }
    }
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// Single points, with bars where there are half-widths.
    Points,
    /// A line, with a band where there are half-widths.
    Line,
}

/// Values over the axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Its colour and form.
    pub role: Role,
    /// How it is drawn.
    pub mark: Mark,
    /// One for each place on the axis.
    pub values: Vec<Option<f64>>,
    /// Half of each 95 % interval; empty where there is none.
    pub half_widths: Vec<Option<f64>>,
}

/// A chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// What it shows, as a finding.
    pub title: String,
    /// How to read it.
    pub caption: String,
    /// The axis along.
    pub x: Axis,
    /// The axis up.
    pub y: Axis,
    /// Places along the axis, ascending.
    pub at: Vec<f64>,
    /// Names of the places, where they are no numbers.
    pub names: Vec<String>,
    /// What is over them.
    pub series: Vec<Series>,
}

impl Chart {
    /// What a screen reader says of the picture.
    pub(crate) fn description(&self) -> String {
        let names: Vec<&str> = self.series.iter().map(|series| series.name.as_str()).collect();
        format!(
            "{}: {} against {}. The numbers are in the table below.",
            names.join(", "),
            self.y.text(),
            self.x.text()
        )
    }

    pub(crate) fn json(&self) -> String {
        let series = |series: &Series| {
            json!({
                "name": series.name,
                "role": series.role.key(),
                "line": series.mark == Mark::Line,
                "values": rounded(&series.values),
                "half": if series.half_widths.is_empty() { Value::Null } else { rounded(&series.half_widths) },
            })
        };
        let at: Vec<Option<f64>> = self.at.iter().copied().map(Some).collect();
        embedded(&json!({
            "x": self.x.text(),
            "y": self.y.text(),
            "log": [self.x.log, self.y.log],
            "at": rounded(&at),
            "names": if self.names.is_empty() { Value::Null } else { json!(self.names) },
            "series": self.series.iter().map(series).collect::<Vec<Value>>(),
        }))
    }

    pub(crate) fn table(&self) -> Table {
        let mut headings = vec![if self.names.is_empty() { self.x.text() } else { self.x.label.clone() }];
        headings.extend(self.series.iter().map(|series| format!("{}: {}", series.name, self.y.text())));
        let mut table = Table { caption: self.title.clone(), headings, rows: Vec::new() };
        for (place, at) in self.at.iter().enumerate() {
            let first = match self.names.get(place) {
                Some(name) => Cell::id(name.clone()),
                None => Cell::number(shown(*at)),
            };
            let cell = |series: &Series| {
                let value = series.values.get(place).copied().flatten();
                let half = series.half_widths.get(place).copied().flatten();
                Cell::number(match (value, half) {
                    (None, _) => "–".to_owned(),
                    (Some(value), None) => shown(value),
                    (Some(value), Some(half)) => format!("{} ± {}", shown(value), shown(half)),
                })
            };
            table.row(std::iter::once(first).chain(self.series.iter().map(cell)));
        }
        table
    }
}

/// Numbers with seven significant digits.
fn rounded(values: &[Option<f64>]) -> Value {
    values.iter().map(|value| value.map_or(Value::Null, |value| numbers::rounded(value, 6))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_says_its_numbers_to_the_script_and_in_a_table() {
        let series = Series {
            name: "before".to_owned(),
            role: Role::Calibrated,
            mark: Mark::Points,
            values: vec![Some(1.0 / 3.0), None],
            half_widths: vec![Some(0.25), None],
        };
        let chart = Chart {
            title: "</script>".to_owned(),
            caption: String::new(),
            x: Axis::new("phase", "°"),
            y: Axis::new("residual", "mm"),
            at: vec![-90.0, 90.0],
            names: Vec::new(),
            series: vec![series],
        };
        let data: Value = serde_json::from_str(&chart.json()).expect("JSON");
        assert_eq!((&data["x"], &data["at"]), (&json!("phase, °"), &json!([-90.0, 90.0])));
        assert_eq!(data["series"][0]["values"], json!([0.333_333_3, null]));
        let table = chart.table();
        assert_eq!(table.headings, ["phase, °", "before: residual, mm"]);
        assert_eq!(table.rows[0], [Cell::number("-90.00"), Cell::number("0.3333 ± 0.2500")]);
        assert_eq!(table.rows[1][1], Cell::number("–"));
    }
}
