//! Fields of operators' bodies, read strictly: what is wrong is told with its place and a hint.

use crate::formats::{is_path_step, nearest};
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::refusal::{Code, Refusal};
use crate::wire::{Fault, Id};
use jiff::Timestamp;

/// The longest id of a thing, in bytes.
const ID_BYTES_MAX: usize = 128;

/// What is wrong with a body, collected until all of it has been read.
#[derive(Debug, Default)]
pub struct Faults(Vec<Fault>);

impl Faults {
    /// Adds one: a code, the place in the body, what is wrong, and what to do instead.
    pub fn add(&mut self, code: &str, pointer: &str, message: String, hint: Option<String>) {
        // A reader takes in no more than a screen of faults.
        if self.0.len() < 20 {
            self.0.push(Fault {
                code: code.to_owned(),
                pointer: pointer.to_owned(),
                message,
                hint,
            });
        }
    }

    /// The refusal, if anything was wrong.
    pub fn check(self, code: Code, what: &str) -> Result<(), Refusal> {
        match self.0.is_empty() {
            true => Ok(()),
            false => Err(self.refusal(code, what)),
        }
    }

    /// The refusal of all that was wrong.
    pub fn refusal(self, code: Code, what: &str) -> Refusal {
        if let [only] = self.0.as_slice() {
            return Refusal::at(code, only.clone());
        }
        let detail = format!("the {what} has {} faults", self.0.len());
        Refusal {
            faults: self.0,
            ..Refusal::new(code, detail)
        }
    }

    /// An instant in RFC 3339.
    pub fn instant(&mut self, pointer: &str, text: Option<&str>) -> Option<Timestamp> {
        let text = text?;
        match text.parse() {
            Ok(instant) => Some(instant),
            Err(_) => {
                let message = format!("'{text}' is not an instant in RFC 3339");
                self.add(
                    "time_invalid",
                    pointer,
                    message,
                    Some("write it like 2026-11-27T18:00:00Z".to_owned()),
                );
                None
            }
        }
    }

    /// A number within bounds, both included.
    pub fn number(
        &mut self,
        pointer: &str,
        value: Option<f64>,
        least: f64,
        most: f64,
    ) -> Option<f64> {
        let value = value?;
        if value.is_finite() && (least..=most).contains(&value) {
            return Some(value);
        }
        let message = format!("{value} is not between {least} and {most}");
        self.add("out_of_range", pointer, message, None);
        None
    }

    /// A fraction, 0 to 1; what looks like percent gets a hint.
    pub fn fraction(&mut self, pointer: &str, value: Option<f64>) -> Option<f64> {
        let value = value?;
        if (0.0..=1.0).contains(&value) {
            return Some(value);
        }
        let message = format!("{value} is not between 0 and 1");
        let is_percent = (1.0..=100.0).contains(&value);
        let hint = is_percent.then(|| format!("did you mean {}?", value / 100.0));
        self.add("out_of_range", pointer, message, hint);
        None
    }

    /// An id that a thing is to have: printable, neither empty nor too long, and no step of a path.
    pub fn id(&mut self, pointer: &str, id: Option<&str>) {
        let Some(id) = id else {
            return;
        };
        if id.is_empty() || id.len() > ID_BYTES_MAX {
            let message = format!("the id has {} bytes, not 1 to {ID_BYTES_MAX}", id.len());
            self.add("id_invalid", pointer, message, None);
        } else if id
            .chars()
            .any(|letter| letter.is_control() || letter == '/')
        {
            let message = "the id has a control character or a slash in it".to_owned();
            let has_slash = id.contains('/') && !id.chars().any(char::is_control);
            let hint = has_slash.then(|| {
                let renamed = id.replace('/', ":");
                format!("a fleet's things are named with a colon: '{renamed}'")
            });
            self.add("id_invalid", pointer, message, hint);
        } else {
            self.no_step("id_invalid", pointer, id);
        }
    }

    /// An id that is a step of a path: addresses are made without such steps, and lead to another thing.
    pub(super) fn no_step(&mut self, code: &str, pointer: &str, id: &str) {
        if is_path_step(id) {
            let message = format!("the id '{id}' cannot stand in an address");
            let hint = "give it one with a letter or a digit".to_owned();
            self.add(code, pointer, message, Some(hint));
        }
    }

    /// A text no longer than a number of bytes.
    pub fn text(&mut self, pointer: &str, text: Option<&str>, bytes_max: usize) {
        if let Some(text) = text.filter(|text| text.len() > bytes_max) {
            let message = format!("the text has {} bytes, more than {bytes_max}", text.len());
            self.add("text_too_long", pointer, message, None);
        }
    }

    /// The node of an id.
    pub fn node(&mut self, pointer: &str, topology: &Topology, id: &Id<'_>) -> Option<NodeIx> {
        let text = id.text();
        let found = topology.node(text);
        if found.is_none() {
            let ids = topology.nodes().map(|node| topology.node_id(node));
            let near = nearest(text, ids, 3);
            let hint = (!near.is_empty()).then(|| format!("did you mean {}?", near.join(", ")));
            self.add(
                "unknown_node",
                pointer,
                format!("the network has no node '{text}'"),
                hint,
            );
        }
        found
    }

    /// The segment of an id.
    pub fn segment(&mut self, pointer: &str, topology: &Topology, id: &str) -> Option<SegmentIx> {
        let found = topology.find_segment(id);
        if found.is_none() {
            let message = format!("the network has no segment '{id}'");
            self.add("unknown_segment", pointer, message, None);
        }
        found
    }
}
