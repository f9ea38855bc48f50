//! XML with positions in its errors. Entities are not expanded, elements and depth are bounded.

use std::path::Path;

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use roxmltree::{Document, Node, ParsingOptions};
use wade_core::frame::Vec3;

use super::ReadError;
use crate::limits::{MOST_DEPTH, MOST_NODES};

/// Parses a document and bounds its depth.
pub fn parse<'a>(path: &Path, text: &'a str) -> Result<Document<'a>, ReadError> {
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options)
        .map_err(|fault| ReadError::Xml { path: path.to_owned(), fault })?;
    let mut depth: Vec<usize> = Vec::new();
    for node in document.descendants() {
        // a parent comes before its children
        let own = node.parent().map_or(0, |parent| depth[parent.id().get_usize()] + 1);
        depth.push(own);
        if own > MOST_DEPTH {
            return Err(ReadError::Deep { path: path.to_owned(), line: line(node) });
        }
    }
    Ok(document)
}

/// Line of an element, from 1.
pub fn line(node: Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

/// An element with the file that it is in, for messages.
#[derive(Debug, Clone, Copy)]
pub struct Element<'a, 'input> {
    /// The file.
    pub path: &'a Path,
    /// The element.
    pub node: Node<'a, 'input>,
}

impl<'a, 'input> Element<'a, 'input> {
    /// Child elements of that name.
    pub fn children(self, name: &'static str) -> impl Iterator<Item = Self> {
        self.node
            .children()
            .filter(move |node| node.has_tag_name(name))
            .map(move |node| Self { node, ..self })
    }

    /// The first child element of that name.
    pub fn child(self, name: &'static str) -> Option<Self> {
        self.children(name).next()
    }

    /// What stands in the `<geometry>` of a shape.
    pub fn geometry(self) -> Result<Self, ReadError> {
        let geometry = self.child("geometry").and_then(Self::first);
        geometry.ok_or_else(|| self.fault("has no <geometry>".to_owned()))
    }

    /// The first child element of any name.
    pub fn first(self) -> Option<Self> {
        self.node.first_element_child().map(|node| Self { node, ..self })
    }

    /// Name of the element.
    pub fn tag(self) -> &'a str {
        self.node.tag_name().name()
    }

    /// Line of the element.
    pub fn line(self) -> u32 {
        line(self.node)
    }

    /// An attribute.
    pub fn attribute(self, name: &str) -> Option<&'a str> {
        self.node.attribute(name)
    }

    /// An attribute that must be there.
    pub fn required(self, name: &str) -> Result<&'a str, ReadError> {
        self.attribute(name).ok_or_else(|| self.fault(format!("has no attribute {name}")))
    }

    /// The text of a child element.
    pub fn text(self, name: &'static str) -> Option<&'a str> {
        self.child(name).and_then(|child| child.node.text()).map(str::trim)
    }

    /// What is wrong with the element.
    pub fn fault(self, what: String) -> ReadError {
        let element = self.tag().to_owned();
        ReadError::Element { path: self.path.to_owned(), line: self.line(), element, what }
    }

    /// Exactly `N` finite numbers of an attribute; `None` where it is absent.
    pub fn numbers<const N: usize>(self, name: &str) -> Result<Option<[f64; N]>, ReadError> {
        self.attribute(name).map(|text| self.parse_numbers(name, text)).transpose()
    }

    /// Exactly `N` finite numbers of a child element's text; `None` where it is absent.
    pub fn text_numbers<const N: usize>(self, name: &'static str) -> Result<Option<[f64; N]>, ReadError> {
        self.text(name).map(|text| self.parse_numbers(name, text)).transpose()
    }

    /// Exactly `N` finite numbers, separated by spaces.
    pub fn parse_numbers<const N: usize>(self, name: &str, text: &str) -> Result<[f64; N], ReadError> {
        let values = self.parse_list(name, text)?;
        let expected = match N {
            1 => "a finite number",
            3 => "three finite numbers",
            4 => "four finite numbers",
            _ => "six finite numbers",
        };
        values.try_into().map_err(|_| self.value(name, text, expected))
    }

    /// Any finite numbers, separated by spaces.
    pub fn parse_list(self, name: &str, text: &str) -> Result<Vec<f64>, ReadError> {
        let number = |word: &str| word.parse::<f64>().ok().filter(|value| value.is_finite());
        let values: Option<Vec<f64>> = text.split_whitespace().map(number).collect();
        values.ok_or_else(|| self.value(name, text, "finite numbers"))
    }

    /// An attribute that is no value.
    pub fn value(self, name: &str, text: &str, expected: &'static str) -> ReadError {
        ReadError::Value {
            path: self.path.to_owned(),
            line: self.line(),
            element: self.tag().to_owned(),
            name: name.to_owned(),
            text: text.chars().take(80).collect(),
            expected,
        }
    }
}

/// Roll, pitch and yaw about fixed axes, as URDF and SDF have them.
pub fn pose(xyz: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Isometry3::from_parts(Translation3::from(Vec3::from(xyz)), turn)
}
