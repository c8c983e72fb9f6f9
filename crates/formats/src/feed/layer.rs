//! Volumes of a feed's zone, and the zones that they become.

use super::collected::{Collected, FeedZone, Reader};
use super::record::Record;
use super::sheet::{Members, Sheet};
use super::times::Applicability;
use crate::airspace::{
    WrittenRing, Zone, ZoneDraft, ZoneFault, ZoneGeometry, ZoneKind, ZoneSource, ZoneTerms,
};
use crate::geo::{Altitude, AltitudeBand, AltitudeReference};
use crate::place::Place;
use crate::zones::{ZoneCode, ZoneProblem, code_and_hint};
use serde_json::Value;
use std::sync::Arc;

/// Metres of an international foot.
const FOOT_M: f64 = 0.3048;
/// What Swiss feeds write for a zone without an upper limit.
const NO_CEILING: f64 = 99_999.0;

/// A unit of length: its name in feeds, and its metres.
pub(super) const UNITS: [(&str, f64); 2] = [("M", 1.0), ("FT", FOOT_M)];
const REFERENCES: [(&str, AltitudeReference); 3] = [
    ("AGL", AltitudeReference::Agl),
    ("AMSL", AltitudeReference::Amsl),
    ("WGS84", AltitudeReference::Wgs84),
];
/// The types of zones as both standards spell them.
pub(super) const KINDS: [(&str, ZoneKind); 6] = [
    ("PROHIBITED", ZoneKind::Prohibited),
    ("REQ_AUTHORISATION", ZoneKind::ReqAuthorization),
    ("REQ_AUTHORIZATION", ZoneKind::ReqAuthorization),
    ("CONDITIONAL", ZoneKind::Conditional),
    ("NO_RESTRICTION", ZoneKind::NoRestriction),
    ("USPACE", ZoneKind::Uspace),
];

/// A volume: a shape between two altitudes.
pub(super) struct Layer {
    pub(super) geometry: ZoneGeometry,
    pub(super) band: AltitudeBand,
    /// JSON Pointer of its shape.
    pub(super) pointer: String,
}

/// A zone as a feed states it.
pub(super) struct FeedDraft {
    pub(super) identifier: String,
    pub(super) kind: ZoneKind,
    pub(super) applies: Applicability,
    pub(super) layers: Vec<Layer>,
    pub(super) record: Record,
}

/// One limit of a volume; a missing value is unlimited.
pub(super) fn read_limit(
    volume: Members<'_>,
    [value_name, reference_name]: [&str; 2],
    unit_m: f64,
    sheet: &mut Sheet,
) -> Option<Option<Altitude>> {
    let Some(value) = volume.get(value_name) else {
        return Some(None);
    };
    let value = sheet.number(value, &volume.place.member(value_name))?;
    if value == NO_CEILING && value_name.starts_with("upper") {
        let place = volume.place.member(value_name);
        sheet.note(&place, "99999 was read as no upper limit");
        return Some(None);
    }
    let Some(reference) = volume.get(reference_name) else {
        sheet.missing(volume.place, reference_name);
        return None;
    };
    let place = volume.place.member(reference_name);
    let reference = sheet.word(reference, &place, &REFERENCES)?;
    Some(Some(Altitude {
        value_m: value * unit_m,
        reference,
    }))
}

/// The rings of a polygon; `latitude_first` is the order of QGroundControl.
pub(super) fn read_rings(
    value: &Value,
    place: &Place<'_>,
    sheet: &mut Sheet,
) -> Option<Vec<WrittenRing>> {
    let Some(rings) = value.as_array() else {
        sheet.refuse(
            ZoneCode::WrongType,
            place,
            "is not a list of rings",
            "write one",
        );
        return None;
    };
    let rings = rings.iter().enumerate();
    rings
        .map(|(index, ring)| read_ring(ring, &place.element(index), sheet))
        .collect()
}

fn read_ring(value: &Value, place: &Place<'_>, sheet: &mut Sheet) -> Option<WrittenRing> {
    let Some(positions) = value.as_array() else {
        sheet.refuse(
            ZoneCode::WrongType,
            place,
            "is not a list of positions",
            "write one",
        );
        return None;
    };
    let mut ring = WrittenRing::with_capacity(positions.len());
    let mut has_heights = false;
    for (index, position) in positions.iter().enumerate() {
        ring.push(read_position(position, &place.element(index), sheet)?);
        has_heights |= position.as_array().is_some_and(|numbers| numbers.len() > 2);
    }
    if has_heights {
        sheet.note(place, "the third numbers of positions were left out");
    }
    if let (Some(first), Some(last)) = (ring.first().copied(), ring.last())
        && first != *last
    {
        sheet.note(place, "the ring was closed");
        ring.push(first);
    }
    Some(ring)
}

/// The first two numbers of a position.
pub(super) fn read_position(
    value: &Value,
    place: &Place<'_>,
    sheet: &mut Sheet,
) -> Option<[f64; 2]> {
    let numbers = value.as_array().map(Vec::as_slice);
    let Some([first, second, ..]) = numbers else {
        let remedy = "write two numbers";
        sheet.refuse(ZoneCode::PositionNotPair, place, "is no position", remedy);
        return None;
    };
    let first = sheet.number(first, &place.element(0));
    let second = sheet.number(second, &place.element(1));
    Some([first?, second?])
}

impl Reader<'_> {
    /// Takes a zone in, or what is wrong with it.
    pub(super) fn take(
        &self,
        identifier: Option<String>,
        pointer: String,
        draft: Option<FeedDraft>,
        sheet: Sheet,
        collected: &mut Collected,
    ) {
        let found = sheet.problems.or(draft);
        let margin_m = sheet.margin_m.unwrap_or(self.terms.margin_m);
        let outcome = found.and_then(|draft| self.zones(draft, margin_m, &pointer));
        let outlines = match (&outcome, &identifier) {
            (Err(_), Some(identifier)) => {
                self.outlines(identifier, sheet.kind, margin_m, sheet.shapes)
            }
            _ => Vec::new(),
        };
        let notes = sheet.notes.into_iter().map(|mut note| {
            note.identifier.clone_from(&identifier);
            note
        });
        collected.notes.extend(notes);
        collected.zones.push(FeedZone {
            identifier,
            pointer,
            outcome,
            outlines,
        });
    }

    /// What is known of a zone that is refused, closed at all heights and always: nothing, where its type closes nothing or a
    /// shape cannot be.
    fn outlines(
        &self,
        identifier: &str,
        kind: Option<ZoneKind>,
        margin_m: f64,
        shapes: Vec<ZoneGeometry>,
    ) -> Vec<Zone> {
        let kind = kind.unwrap_or(ZoneKind::Prohibited);
        if !kind.closes() {
            return Vec::new();
        }
        let layers = shapes.into_iter().map(|geometry| Layer {
            geometry,
            band: AltitudeBand::UNLIMITED,
            pointer: String::new(),
        });
        let draft = FeedDraft {
            identifier: identifier.to_owned(),
            kind,
            applies: Applicability::default(),
            layers: layers.collect(),
            record: Record::empty(),
        };
        self.zones(draft, margin_m, "").unwrap_or_default()
    }

    /// The zones of a draft: one for each of its volumes.
    fn zones(
        &self,
        draft: FeedDraft,
        margin_m: f64,
        pointer: &str,
    ) -> Result<Vec<Zone>, Vec<ZoneProblem>> {
        let FeedDraft {
            identifier,
            kind,
            applies,
            layers,
            record,
        } = draft;
        let applies = applies.simplified();
        let terms = ZoneTerms {
            kind,
            is_authorized: false,
            schedules: applies.schedules,
            source: Some(ZoneSource {
                feed: self.terms.feed.to_owned(),
                id: identifier.clone(),
            }),
            record: record.json().map(Arc::from),
        };
        let texts = record.texts();
        let count = layers.len();
        let (mut zones, mut problems) = (Vec::with_capacity(count), Vec::new());
        for (number, layer) in (1..).zip(layers) {
            let prefix = self.terms.prefix;
            let id = match count {
                1 => format!("{prefix}{identifier}"),
                _ => format!("{prefix}{identifier}~{number}"),
            };
            let shape = layer.geometry.clone();
            let zone = ZoneDraft {
                id,
                name: texts.name.clone(),
                reason: texts.reason.clone(),
                authority: texts.authority.clone(),
                geometry: layer.geometry,
                band: layer.band,
                windows: applies.windows.clone(),
                margin_m,
                terms: terms.clone(),
            };
            match Zone::new(zone, self.frame) {
                Ok(zone) => zones.push(zone),
                Err(faults) => {
                    let told = faults.iter();
                    problems.extend(
                        told.map(|fault| told_fault(fault, &shape, pointer, &layer.pointer)),
                    );
                }
            }
        }
        match problems.is_empty() {
            true => Ok(zones),
            false => Err(problems),
        }
    }
}

fn told_fault(fault: &ZoneFault, shape: &ZoneGeometry, zone: &str, layer: &str) -> ZoneProblem {
    let (code, hint, pointer) = match fault {
        ZoneFault::Geometry(error) => {
            let (code, hint) = code_and_hint(&error.fault);
            let polygon = error
                .place
                .polygon
                .filter(|_| matches!(shape, ZoneGeometry::MultiPolygon(_)));
            let steps = [polygon, error.place.ring, error.place.vertex];
            let steps = steps.into_iter().flatten().map(|step| format!("/{step}"));
            (code, hint, format!("{layer}{}", steps.collect::<String>()))
        }
        ZoneFault::EmptyId => (ZoneCode::IdEmpty, None, zone.to_owned()),
        ZoneFault::TextTooLong { .. } | ZoneFault::RecordTooDeep(_) => {
            (ZoneCode::TextTooLong, Some("shorten it"), zone.to_owned())
        }
        ZoneFault::AltitudeNotFinite => (ZoneCode::AltitudeInvalid, None, layer.to_owned()),
        ZoneFault::BandReversed { .. } => (
            ZoneCode::BandReversed,
            Some("were the limits swapped?"),
            layer.to_owned(),
        ),
        ZoneFault::TooManyWindows { .. } => (ZoneCode::TooManyWindows, None, zone.to_owned()),
        ZoneFault::TooManyPeriods { .. } => (ZoneCode::TooManyPeriods, None, zone.to_owned()),
        ZoneFault::ScheduleEmpty | ZoneFault::NoSun => {
            (ZoneCode::ScheduleInvalid, None, zone.to_owned())
        }
        ZoneFault::Margin { .. } => (ZoneCode::MarginInvalid, None, zone.to_owned()),
        ZoneFault::NotAuthorizable { .. } => (ZoneCode::NotAuthorizable, None, zone.to_owned()),
    };
    let problem = ZoneProblem::new(code, pointer, fault.to_string());
    match hint {
        Some(hint) => problem.hint(hint),
        None => problem,
    }
}
