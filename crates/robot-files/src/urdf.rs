//! A URDF: its joints, the shapes of its links, and what plugins of simulators say of the wheels.

use std::collections::BTreeMap;
use std::ops::Range;

use roxmltree::{Attribute, Document, Node, ParsingOptions};

use crate::entries::Scalar;
use crate::error::RobotFileError;

/// Most nodes of a URDF.
const MAX_NODES: u32 = 1_000_000;

/// Three numbers, each with its bytes where it is written.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Triple {
    pub(crate) value: [f64; 3],
    pub(crate) spans: [Option<Range<usize>>; 3],
}

/// Where a frame stands in the one around it.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Origin {
    pub(crate) xyz: Triple,
    pub(crate) rpy: [f64; 3],
}

/// A joint.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Joint {
    pub(crate) name: String,
    pub(crate) kind: String,
    pub(crate) parent: String,
    pub(crate) child: String,
    pub(crate) origin: Origin,
    pub(crate) axis: [f64; 3],
}

/// A cylinder or a ball of a link.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RoundShape {
    pub(crate) radius_m: f64,
    pub(crate) span: Option<Range<usize>>,
    pub(crate) origin: Origin,
}

/// All of a URDF that concerns wheels.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Urdf {
    pub(crate) joints: Vec<Joint>,
    /// Shapes of links, those of collisions first.
    pub(crate) shapes: BTreeMap<String, Vec<RoundShape>>,
    /// What plugins say, by the name of the element.
    pub(crate) plugins: Vec<(String, Scalar)>,
}

/// Elements of plugins of Gazebo, in both spellings.
const PLUGIN: [&str; 8] = [
    "wheel_separation",
    "wheelSeparation",
    "wheel_radius",
    "wheelRadius",
    "wheel_diameter",
    "wheelDiameter",
    "left_joint",
    "right_joint",
];

impl Urdf {
    pub(crate) fn parse(text: &str) -> Result<Self, RobotFileError> {
        let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
        let is_xacro = text.contains("<xacro:");
        let document = Document::parse_with_options(text, options).map_err(|error| match is_xacro {
            true => RobotFileError::Xacro,
            false => RobotFileError::NotXml { why: error.to_string() },
        })?;
        let root = document.root_element();
        if root.descendants().any(|node| node.tag_name().namespace().is_some_and(|name| name.contains("xacro"))) {
            return Err(RobotFileError::Xacro);
        }
        if root.tag_name().name() != "robot" {
            return Err(RobotFileError::NotARobot { root: root.tag_name().name().to_owned() });
        }
        let mut urdf = Self::default();
        for node in root.children().filter(Node::is_element) {
            match node.tag_name().name() {
                "joint" => urdf.joints.extend(joint(text, node)?),
                "link" => {
                    let name = node.attribute("name").unwrap_or_default().to_owned();
                    let mut shapes = Vec::new();
                    for kind in ["collision", "visual"] {
                        for part in node.children().filter(|part| part.has_tag_name(kind)) {
                            shapes.extend(round_shape(text, part)?);
                        }
                    }
                    urdf.shapes.insert(name, shapes);
                }
                _ => {}
            }
        }
        for node in root.descendants().filter(|node| PLUGIN.contains(&node.tag_name().name())) {
            let Some(written) = node.children().find(Node::is_text) else { continue };
            let (range, value) = (written.range(), written.text().unwrap_or_default());
            let trimmed = value.trim();
            let start = range.start + (value.len() - value.trim_start().len());
            let span =
                (text.get(start..start + trimmed.len()) == Some(trimmed)).then_some(start..start + trimmed.len());
            urdf.plugins.push((node.tag_name().name().to_owned(), Scalar { text: trimmed.to_owned(), span }));
        }
        Ok(urdf)
    }

    /// What a plugin says, by one of two spellings.
    pub(crate) fn plugin(&self, names: &[&str]) -> Option<&Scalar> {
        self.plugins.iter().find(|(name, _)| names.contains(&&name[..])).map(|(_, value)| value)
    }
}

fn joint(text: &str, node: Node<'_, '_>) -> Result<Option<Joint>, RobotFileError> {
    let child = |name: &str| node.children().find(|child| child.has_tag_name(name));
    let link = |name: &str| child(name).and_then(|child| child.attribute("link")).map(str::to_owned);
    // Joints of <transmission> and the like have no links.
    let (Some(parent), Some(of)) = (link("parent"), link("child")) else { return Ok(None) };
    let axis = match child("axis") {
        Some(axis) => triple(text, axis, "xyz")?.map_or([1.0, 0.0, 0.0], |axis| axis.value),
        None => [1.0, 0.0, 0.0],
    };
    Ok(Some(Joint {
        name: node.attribute("name").unwrap_or_default().to_owned(),
        kind: node.attribute("type").unwrap_or_default().to_owned(),
        parent,
        child: of,
        origin: origin(text, node)?,
        axis,
    }))
}

fn origin(text: &str, node: Node<'_, '_>) -> Result<Origin, RobotFileError> {
    let Some(origin) = node.children().find(|child| child.has_tag_name("origin")) else { return Ok(Origin::default()) };
    let rpy = triple(text, origin, "rpy")?.map_or([0.0; 3], |rpy| rpy.value);
    Ok(Origin { xyz: triple(text, origin, "xyz")?.unwrap_or_default(), rpy })
}

fn round_shape(text: &str, node: Node<'_, '_>) -> Result<Option<RoundShape>, RobotFileError> {
    let is_round = |shape: &Node<'_, '_>| shape.has_tag_name("cylinder") || shape.has_tag_name("sphere");
    let geometry = node.children().find(|child| child.has_tag_name("geometry"));
    let Some(shape) = geometry.and_then(|geometry| geometry.children().find(is_round)) else { return Ok(None) };
    let Some(radius) = shape.attribute_node("radius") else { return Ok(None) };
    let value = scalar(text, radius);
    let radius_m = value.number().ok_or_else(|| not_a_number("radius", radius.value()))?;
    Ok(Some(RoundShape { radius_m, span: value.span, origin: origin(text, node)? }))
}

fn not_a_number(key: &str, value: &str) -> RobotFileError {
    if value.contains("${") || value.contains("$(") {
        return RobotFileError::Xacro;
    }
    RobotFileError::NotANumber { key: key.to_owned(), value: value.to_owned() }
}

/// The value of an attribute, without the white space around it.
fn scalar(text: &str, attribute: Attribute<'_, '_>) -> Scalar {
    let (range, value) = (attribute.range_value(), attribute.value());
    let trimmed = value.trim();
    let start = range.start + (value.len() - value.trim_start().len());
    let span = (text.get(range) == Some(value)).then_some(start..start + trimmed.len());
    Scalar { text: trimmed.to_owned(), span }
}

fn triple(text: &str, node: Node<'_, '_>, name: &str) -> Result<Option<Triple>, RobotFileError> {
    let Some(attribute) = node.attribute_node(name) else { return Ok(None) };
    let (range, value) = (attribute.range_value(), attribute.value());
    // White space is read as blanks.
    let is_read = |(raw, of): (u8, u8)| raw == of || (raw.is_ascii_whitespace() && of == b' ');
    let is_plain = text
        .get(range.clone())
        .is_some_and(|raw| raw.len() == value.len() && raw.bytes().zip(value.bytes()).all(is_read));
    let mut found = Triple::default();
    let mut parts = value.split_ascii_whitespace();
    for (number, span) in found.value.iter_mut().zip(&mut found.spans) {
        let part = parts.next().ok_or_else(|| not_a_number(name, value))?;
        *number = part.parse().ok().filter(|of: &f64| of.is_finite()).ok_or_else(|| not_a_number(name, value))?;
        let at = range.start + (part.as_ptr() as usize - value.as_ptr() as usize);
        *span = is_plain.then_some(at..at + part.len());
    }
    Ok(Some(found))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_urdf_is_said_to_be_none() {
        let of = |text: &str| Urdf::parse(text).expect_err("no URDF").to_string();
        let declared = "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\"><xacro:include filename=\"a\"/></robot>";
        for xacro in [
            declared,
            "<robot><xacro:wheel/></robot>",
            "<robot><link name=\"w\"><collision><geometry><cylinder radius=\"${r}\"/></geometry></collision></link></robot>",
        ] {
            assert!(
                of(xacro).starts_with("it is a xacro, whose values ROS computes; write them out: xacro FILE"),
                "{xacro}"
            );
        }
        assert_eq!(of("<sdf version=\"1.7\"/>"), "the XML is a <sdf>; expected the <robot> of a URDF");
        assert!(of("<robot>").starts_with("no XML: "));
        let joint = "<joint type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/><origin xyz=\"0 x 0\"/></joint>";
        assert!(of(&format!("<robot>{joint}</robot>")).starts_with("xyz: \"0 x 0\" is no number"));
    }

    #[test]
    fn numbers_stand_where_their_bytes_are() {
        let text = "<robot><joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/>\
                    <origin rpy='0 0 0' xyz=' 0.1\t-0.2  3e-1 '/></joint>\
                    <link name=\"b\"><visual><geometry><sphere radius=\" 0.5 \"/></geometry></visual></link>\
                    <gazebo><plugin><wheel_separation> 0.4\n</wheel_separation></plugin></gazebo></robot>";
        let urdf = Urdf::parse(text).expect("a URDF");
        let xyz = &urdf.joints[0].origin.xyz;
        let of = |span: &Option<Range<usize>>| span.clone().map(|span| &text[span]);
        assert_eq!(xyz.spans.each_ref().map(of), [Some("0.1"), Some("-0.2"), Some("3e-1")]);
        assert_eq!(of(&urdf.shapes["b"][0].span), Some("0.5"));
        assert_eq!(of(&urdf.plugin(&["wheel_separation"]).expect("there").span), Some("0.4"));
    }
}
