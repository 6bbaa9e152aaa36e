//! Tables of motion capture: Motive's (OptiTrack) and Vicon's CSV, whose names stand in several lines above
//! the rows and which hold several bodies in space. The body that is meant becomes a table of time, x, y and
//! heading in the same lines.
//!
//! Heading: the rotation about the axis that is up, of z-y-x Euler angles after the room was turned so that
//! up is z. Motive's y is up: (x, y, z) becomes (x, −z, y).

use std::fmt::Write as _;
use std::path::Path;

use super::text::{Decimal, Delimiter};
use crate::error::{DatasetError, shown};
use crate::quaternion::Quaternion;

/// Lines among which the names stand.
const MAX_HEADER_LINES: usize = 12;

/// A robot's height varies by so many times less than its way along another axis; else the format's own axis
/// counts as up.
const FLAT: f64 = 5.0;

/// A body's columns, by their numbers.
#[derive(Debug, Clone)]
struct Body {
    name: String,
    position: [usize; 3],
    rotation: Rotation,
}

/// How an orientation is written.
#[derive(Debug, Clone)]
enum Rotation {
    None,
    /// x, y, z and the scalar.
    Quaternion([usize; 4]),
    /// A vector along the axis whose length is the angle, and the angle's unit in radians.
    AngleAxis([usize; 3], f64),
    /// Angles in degrees about axes of the body that follow each other, by the axes' numbers.
    Euler([(usize, usize); 3]),
}

/// Where the names stand, and what they say.
#[derive(Debug)]
struct Layout {
    format: &'static str,
    /// The line of the columns' names, from 0, and that of the first row.
    names_line: usize,
    first_row: usize,
    bodies: Vec<Body>,
    /// The column of the time and seconds of one unit in it.
    time: (usize, f64),
    /// The unit of lengths by its usual name.
    length: &'static str,
    /// The axis that is up by the format: 1 is y, 2 is z.
    up: usize,
}

/// The table of one body, and what a user should read of it; `None` of what is no such table.
///
/// # Errors
/// [`DatasetError::Undecided`] where several bodies are in it and `body` names none of them.
pub(super) fn table(file: &Path, text: &str, body: Option<&str>) -> Result<Option<(String, String)>, DatasetError> {
    let head: Vec<&str> = text.lines().take(MAX_HEADER_LINES).collect();
    let Some(layout) = motive(&head).or_else(|| vicon(&head)) else { return Ok(None) };
    let line = layout.names_line as u64 + 1;
    let foreign = |line: u64, message: String| DatasetError::Foreign { file: file.to_owned(), line, message };
    let names: Vec<&str> = layout.bodies.iter().map(|body| body.name.as_str()).collect();
    let chosen = match (body, &layout.bodies[..]) {
        (_, []) => return Err(foreign(line, format!("a table of {} without a rigid body", layout.format))),
        (None, [one]) => one,
        (None, _) => {
            const SHOWN: usize = 8;
            let listed: Vec<String> = names.iter().take(SHOWN).map(|name| shown(name.as_bytes())).collect();
            return Err(DatasetError::Undecided {
                file: file.to_owned(),
                what: "the robot's body".to_owned(),
                readings: listed.join(" or "),
                flag: format!("--body {}", listed.join(" or --body ")),
            });
        }
        (Some(body), all) => all.iter().find(|of| of.name == body || short(&of.name) == body).ok_or_else(|| {
            foreign(line, format!("--body {}: the bodies are {}", shown(body.as_bytes()), names.join(", ")))
        })?,
    };
    let up = up_axis(&layout, chosen, text);
    let mut table = String::with_capacity(text.len() / 2);
    let mut fields = Vec::new();
    for (number, row) in text.lines().enumerate() {
        if number == layout.names_line {
            let _ = writeln!(table, "t [s],x [{0}],y [{0}],theta [rad]", layout.length);
            continue;
        }
        if number < layout.first_row || row.trim_matches([',', ' ', '\t', '\r']).is_empty() {
            table.push('\n');
            continue;
        }
        Delimiter::Comma.split(row, &mut fields);
        let number_at = |column: usize| fields.get(column).and_then(|field| Decimal::Point.number(field));
        let Some(time) = fields.get(layout.time.0).copied().filter(|time| !time.is_empty()) else {
            return Err(foreign(number as u64 + 1, "a row without its time; is the file cut off?".to_owned()));
        };
        // A stamp of seconds keeps its digits.
        match Decimal::Point.number(time) {
            Some(frame) if layout.time.1 != 1.0 => {
                let _ = write!(table, "{}", frame * layout.time.1);
            }
            _ => table.push_str(time),
        }
        let position = chosen.position.map(number_at);
        let placed = position.iter().flatten().filter(|value| value.is_finite()).count() == position.len();
        let [x, y, z] = position.map(|value| value.unwrap_or(f64::NAN));
        let (plane_x, plane_y) = if up == 1 { (x, -z) } else { (x, y) };
        let theta = quaternion(&chosen.rotation, number_at).and_then(|[qx, qy, qz, qw]| {
            let turned = if up == 1 { [qx, -qz, qy, qw] } else { [qx, qy, qz, qw] };
            Quaternion::new(turned).map(Quaternion::yaw_rad)
        });
        // Of a frame in which the body was not seen nothing is said.
        if placed {
            let _ = write!(table, ",{plane_x},{plane_y},");
        } else {
            table.push_str(",,,");
        }
        if let Some(theta) = theta.filter(|_| placed) {
            let _ = write!(table, "{theta}");
        }
        table.push('\n');
    }
    let remark = format!(
        "{}: a table of {}: the poses are those of body {}, {} is up{}",
        file.display(),
        layout.format,
        shown(chosen.name.as_bytes()),
        if up == 1 { "y" } else { "z" },
        if matches!(chosen.rotation, Rotation::None) { ", without a heading" } else { "" }
    );
    Ok(Some((table, remark)))
}

/// Vicon writes `subject:segment`.
fn short(name: &str) -> &str {
    name.split_once(':').map_or(name, |(subject, _)| subject)
}

fn split(line: &str) -> Vec<&str> {
    let mut fields = Vec::new();
    Delimiter::Comma.split(line.trim_end_matches('\r'), &mut fields);
    fields
}

/// The axis among y and z along which the body hardly moves, where that is plain; else the format's.
fn up_axis(layout: &Layout, body: &Body, text: &str) -> usize {
    let (mut least, mut most) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let mut fields = Vec::new();
    for row in text.lines().skip(layout.first_row) {
        Delimiter::Comma.split(row, &mut fields);
        for (axis, &column) in body.position.iter().enumerate() {
            if let Some(value) = fields.get(column).and_then(|field| Decimal::Point.number(field))
                && value.is_finite()
            {
                (least[axis], most[axis]) = (least[axis].min(value), most[axis].max(value));
            }
        }
    }
    let range = |axis: usize| most[axis] - least[axis];
    let other = 3 - layout.up;
    if range(layout.up) > FLAT * range(other) && range(0) > FLAT * range(other) { other } else { layout.up }
}

/// x, y, z and the scalar of a row.
fn quaternion(rotation: &Rotation, number_at: impl Fn(usize) -> Option<f64>) -> Option<[f64; 4]> {
    let about = |axis: [f64; 3], angle_rad: f64| {
        let (sin, cos) = (0.5 * angle_rad).sin_cos();
        [axis[0] * sin, axis[1] * sin, axis[2] * sin, cos]
    };
    match rotation {
        Rotation::None => None,
        Rotation::Quaternion(columns) => {
            let mut parts = [0.0; 4];
            for (part, &column) in parts.iter_mut().zip(columns) {
                *part = number_at(column)?;
            }
            Some(parts)
        }
        Rotation::AngleAxis(columns, rad) => {
            let mut vector = [0.0; 3];
            for (part, &column) in vector.iter_mut().zip(columns) {
                *part = number_at(column)? * rad;
            }
            let angle_rad = vector.iter().map(|part| part * part).sum::<f64>().sqrt();
            let axis = if angle_rad > 0.0 { vector.map(|part| part / angle_rad) } else { [0.0, 0.0, 1.0] };
            Some(about(axis, angle_rad))
        }
        Rotation::Euler(angles) => {
            let mut turned = [0.0, 0.0, 0.0, 1.0];
            for &(axis, column) in angles {
                let mut along = [0.0; 3];
                along[axis] = 1.0;
                turned = product(turned, about(along, number_at(column)?.to_radians()));
            }
            Some(turned)
        }
    }
}

/// The product of two quaternions whose scalars stand last.
fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    let ([ax, ay, az, aw], [bx, by, bz, bw]) = (a, b);
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

/// Motive: keys in the first line; then lines of type, name and id, `Rotation` or `Position`, and axes.
fn motive(head: &[&str]) -> Option<Layout> {
    let keys = split(head.first()?);
    if !keys.first()?.eq_ignore_ascii_case("Format Version") {
        return None;
    }
    let of_key = |key: &str| keys.iter().position(|of| of.eq_ignore_ascii_case(key)).and_then(|at| keys.get(at + 1));
    let names_line = head.iter().position(|line| split(line).first().is_some_and(|first| *first == "Frame"))?;
    let (axes, kinds) = (split(head[names_line]), split(head[names_line.checked_sub(1)?]));
    let line_of = |word: &str| head[..names_line].iter().map(|line| split(line)).find(|of| of.get(1) == Some(&word));
    let (types, names) = (line_of("Type")?, line_of("Name")?);
    let time = axes.iter().position(|name| name.starts_with("Time"))?;
    let order = of_key("Rotation Type").copied().unwrap_or("Quaternion");
    let mut bodies: Vec<Body> = Vec::new();
    for (first, name) in names.iter().enumerate().skip(2) {
        let is_new = types.get(first) == Some(&"Rigid Body") && !bodies.iter().any(|body| body.name == *name);
        if !is_new {
            continue;
        }
        let column = |kind: &str, axis: &str| {
            (first..names.len().min(axes.len())).find(|&at| {
                names[at] == *name
                    && types.get(at) == Some(&"Rigid Body")
                    && kinds.get(at) == Some(&kind)
                    && axes[at] == axis
            })
        };
        let all = |kind: &str| ["X", "Y", "Z"].map(|axis| column(kind, axis));
        let [Some(x), Some(y), Some(z)] = all("Position") else { continue };
        let rotation = match (all("Rotation"), column("Rotation", "W")) {
            ([Some(qx), Some(qy), Some(qz)], Some(qw)) => Rotation::Quaternion([qx, qy, qz, qw]),
            (angles @ [Some(_), Some(_), Some(_)], None) => euler(order, angles.map(Option::unwrap_or_default)),
            _ => Rotation::None,
        };
        bodies.push(Body { name: (*name).to_owned(), position: [x, y, z], rotation });
    }
    let length = match of_key("Length Units").map(|unit| unit.to_lowercase()).as_deref() {
        Some("millimeters" | "mm") => "mm",
        Some("centimeters" | "cm") => "cm",
        _ => "m",
    };
    let (format, first_row) = ("Motive", names_line + 1);
    Some(Layout { format, names_line, first_row, bodies, time: (time, 1.0), length, up: 1 })
}

/// Angles by the order of their axes, as `XYZ`.
fn euler(order: &str, columns: [usize; 3]) -> Rotation {
    let axes: Vec<usize> = order.chars().filter_map(|axis| "XYZ".find(axis)).collect();
    match axes[..] {
        [first, second, third] => Rotation::Euler([first, second, third].map(|axis| (axis, columns[axis]))),
        _ => Rotation::None,
    }
}

/// Vicon: the rate, lines of names, columns and units.
fn vicon(head: &[&str]) -> Option<Layout> {
    let is_names = |line: &&str| {
        let fields = split(line);
        fields.first() == Some(&"Frame") && fields.get(1).is_some_and(|second| second.starts_with("Sub Frame"))
    };
    let names_line = head.iter().position(is_names)?;
    let (columns, subjects) = (split(head[names_line]), split(head[names_line.checked_sub(1)?]));
    let units = split(head.get(names_line + 1)?);
    let rate = head[..names_line].iter().find_map(|line| {
        let rate = Decimal::Point.number(split(line).first()?)?;
        (rate.is_finite() && rate > 0.0).then_some(rate)
    })?;
    let mut bodies = Vec::new();
    for (first, name) in subjects.iter().enumerate().filter(|(at, name)| *at >= 2 && !name.is_empty()) {
        let next = (first + 1..subjects.len()).find(|&at| !subjects[at].is_empty()).unwrap_or(columns.len());
        let column = |axis: &str| (first..next.min(columns.len())).find(|&at| columns[at] == axis);
        let [Some(x), Some(y), Some(z)] = ["TX", "TY", "TZ"].map(column) else { continue };
        let rad = |at: usize| if units.get(at) == Some(&"deg") { 1.0_f64.to_radians() } else { 1.0 };
        let rotation = match (["RX", "RY", "RZ"].map(column), column("RW")) {
            ([Some(qx), Some(qy), Some(qz)], Some(qw)) => Rotation::Quaternion([qx, qy, qz, qw]),
            ([Some(rx), Some(ry), Some(rz)], None) => Rotation::AngleAxis([rx, ry, rz], rad(rx)),
            _ => Rotation::None,
        };
        bodies.push(Body { name: (*name).to_owned(), position: [x, y, z], rotation });
    }
    let of_length = bodies.first().and_then(|body: &Body| units.get(body.position[0]).copied());
    let length = match of_length {
        Some("m") => "m",
        Some("cm") => "cm",
        _ => "mm",
    };
    let (format, time) = ("Vicon", (0, 1.0 / rate));
    Some(Layout { format, names_line, first_row: names_line + 2, bodies, time, length, up: 2 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, body: Option<&str>) -> Result<Option<(String, String)>, DatasetError> {
        table(Path::new("take.csv"), text, body)
    }

    /// The numbers of a row of the table.
    fn row(table: &str, line: usize) -> Vec<f64> {
        table.lines().nth(line).expect("a row").split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect()
    }

    fn close(found: &[f64], expected: &[f64]) -> bool {
        found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12)
    }

    const MOTIVE: &str = "Format Version,1.23,Take Name,t,Rotation Type,ROTATION,Length Units,Meters\n\n\
        ,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Marker\n\
        ,Name,robot,robot,robot,robot,robot,robot,robot,robot:1\n";

    #[test]
    fn motive_turns_about_y() {
        // A robot that is turned by 0.6 rad to the left stands a metre along x and two to its left: z = -2.
        let (sin, cos) = 0.3_f64.sin_cos();
        let quaternions = MOTIVE.replace("ROTATION", "Quaternion")
            + ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Position\n\
               Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,X\n"
            + &format!("0,0.0,0,{sin},0,{cos},1,0.1,-2,9\n1,0.01,,,,,,,,\n");
        let (table, remark) = read(&quaternions, None).expect("a body").expect("a table");
        assert_eq!(table.lines().nth(5), Some("t [s],x [m],y [m],theta [rad]"));
        assert!(close(&row(&table, 6), &[0.0, 1.0, 2.0, 0.6]), "{table}");
        // A frame in which it was not seen.
        assert_eq!(table.lines().nth(7), Some("0.01,,,"));
        assert!(remark.contains("body robot, y is up"), "{remark}");

        // The same as angles about x, y and z, by which a half turn and more is written as two of the others.
        let euler =
            MOTIVE.replace("ROTATION", "XYZ").replace(",Rigid Body,Marker", ",Marker").replacen(",robot,", ",", 1)
                + ",,Rotation,Rotation,Rotation,Position,Position,Position,Position\n\
               Frame,Time (Seconds),X,Y,Z,X,Y,Z,X\n0,0.0,0,30,0,1,0.1,-2,9\n1,0.1,180,30,180,1,0.1,-2,9\n";
        let (table, _) = read(&euler, None).expect("a body").expect("a table");
        assert!(close(&row(&table, 6), &[0.0, 1.0, 2.0, 30_f64.to_radians()]), "{table}");
        assert!(close(&row(&table, 7), &[0.1, 1.0, 2.0, 150_f64.to_radians()]), "{table}");
    }

    #[test]
    fn vicon_turns_about_an_axis_and_a_body_is_named() {
        let text = "Objects\n100\n,,arena:arena,,,,,,robot:robot,,,,,\n\
            Frame,Sub Frame,RX,RY,RZ,TX,TY,TZ,RX,RY,RZ,TX,TY,TZ\n,,rad,rad,rad,mm,mm,mm,rad,rad,rad,mm,mm,mm\n\
            1,0,0,0,0,0,0,0,0,0,-2.5,1000,2000,90\n";
        let error = read(text, None).expect_err("two bodies").to_string();
        assert!(error.contains("--body arena:arena or --body robot:robot"), "{error}");
        let error = read(text, Some("cart")).expect_err("none of that name").to_string();
        assert!(error.contains("the bodies are arena:arena, robot:robot"), "{error}");
        for name in ["robot", "robot:robot"] {
            let (table, _) = read(text, Some(name)).expect("a body").expect("a table");
            assert!(table.contains("x [mm]") && close(&row(&table, 5), &[0.01, 1000.0, 2000.0, -2.5]), "{table}");
        }
    }

    #[test]
    fn other_tables_are_left_as_they_are() {
        assert!(read("time,x,y\n0,1,2\n", None).expect("no fault").is_none());
        assert!(read("Frame,x,y\n0,1,2\n", None).expect("no fault").is_none());
        assert!(read("", None).expect("no fault").is_none());
    }
}
