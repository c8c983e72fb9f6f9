//! Whether one closure is at least as strict as another: it closes all that the other does, whenever that does.
//!
//! The answer is cautious: `false` where it cannot be seen easily. Who follows a source that is in doubt takes
//! over what is stricter than before, and nothing else.

use super::closure::Closure;
use super::zone::{Window, Zone};
use crate::geo::{Altitude, AltitudeBand, BoxRelation, Outline, Polygon, PreparedShape};
use jiff::Timestamp;

impl Closure {
    /// True where this closure surely closes everything that `other` closes from `now` on.
    ///
    /// Both are of the same topology.
    pub fn encloses(&self, other: &Self, now: Timestamp) -> bool {
        let holds_longer = match self.zone().filter(|zone| zone.recurs()) {
            None => windows_enclose(&self.windows, &other.windows, now),
            // What recurs differs from day to day: only the same schedule surely holds as long.
            Some(zone) => other
                .zone()
                .is_some_and(|other| has_same_times(zone, other)),
        };
        let has_pads = other.pads.iter().all(|node| self.pads.contains(node));
        let is_wider = match (self.zone(), other.zone()) {
            (Some(zone), Some(other)) => zone_encloses(zone, other),
            (None, None) => {
                let (hits, others) = (&self.hits, &other.hits);
                let mut segments = others.segments.iter();
                let mut nodes = others.nodes.iter();
                segments.all(|segment| hits.segments.binary_search(segment).is_ok())
                    && nodes.all(|node| hits.nodes.binary_search(node).is_ok())
            }
            _ => false,
        };
        holds_longer && has_pads && is_wider
    }
}

fn has_same_times(zone: &Zone, other: &Zone) -> bool {
    zone.plain_windows() == other.plain_windows()
        && zone.terms().schedules == other.terms().schedules
}

/// Whether each window that is not over lies in one of the others, as far as it is still ahead.
fn windows_enclose(windows: &[Window], others: &[Window], now: Timestamp) -> bool {
    if windows.is_empty() {
        return true;
    }
    let begins_by = |window: &Window, from: Timestamp| window.from().is_none_or(|own| own <= from);
    if others.is_empty() {
        let mut all = windows.iter();
        return all.any(|window| begins_by(window, now) && window.until().is_none());
    }
    let ahead = others
        .iter()
        .filter(|other| other.until().is_none_or(|until| until >= now));
    ahead.into_iter().all(|other| {
        let from = other.from().map_or(now, |from| from.max(now));
        windows.iter().any(|window| {
            let ends_later = match (window.until(), other.until()) {
                (None, _) => true,
                (Some(_), None) => false,
                (Some(own), Some(other)) => own >= other,
            };
            begins_by(window, from) && ends_later
        })
    })
}

fn zone_encloses(zone: &Zone, other: &Zone) -> bool {
    if !other.terms().closes() {
        return true;
    }
    let spare_m = zone.margin_m() - other.margin_m();
    zone.terms().closes()
        && spare_m >= 0.0
        && band_encloses(zone.band(), other.band())
        && (zone.geometry() == other.geometry()
            || shape_encloses(zone.shape(), other.shape(), spare_m))
}

fn band_encloses(band: &AltitudeBand, other: &AltitudeBand) -> bool {
    let reaches = |own: Option<Altitude>, other: Option<Altitude>, down: f64| match (own, other) {
        (None, _) => true,
        (Some(_), None) => false,
        (Some(own), Some(other)) => {
            own.reference == other.reference && own.value_m * down <= other.value_m * down
        }
    };
    reaches(band.lower, other.lower, 1.0) && reaches(band.upper, other.upper, -1.0)
}

/// Whether a shape, widened by `spare_m`, holds another.
fn shape_encloses(shape: &PreparedShape, other: &PreparedShape, spare_m: f64) -> bool {
    match (shape.shape().outline(), other.shape().outline()) {
        (
            Outline::Circle { centre, radius_m },
            Outline::Circle {
                centre: other_centre,
                radius_m: other_radius_m,
            },
        ) => centre.distance_m(*other_centre) + other_radius_m <= radius_m + spare_m,
        // What has no hole and is one piece holds whatever lies within a boundary that it covers.
        (Outline::Circle { .. }, Outline::Polygons(polygons)) => {
            covers_boundaries(shape, polygons, spare_m)
        }
        (Outline::Polygons(own), Outline::Polygons(polygons)) => {
            matches!(own.as_slice(), [only] if only.holes().is_empty())
                && covers_boundaries(shape, polygons, spare_m)
        }
        (Outline::Polygons(_), Outline::Circle { .. }) => {
            shape.relation_to_box(other.bounds(), spare_m) == BoxRelation::Inside
        }
    }
}

fn covers_boundaries(shape: &PreparedShape, polygons: &[Polygon], spare_m: f64) -> bool {
    let mut edges = polygons.iter().flat_map(|polygon| polygon.outer().edges());
    edges.all(|(from, to)| shape.coverage(from, to, spare_m).as_slice() == [(0.0, 1.0)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::airspace::{ZoneDraft, ZoneGeometry};
    use crate::geo::Frame;
    use std::sync::Arc;

    fn instant(hour: u32) -> Timestamp {
        let text = format!("2026-11-21T{hour:02}:00:00Z");
        text.parse().expect("an instant")
    }

    fn window(from: u32, until: u32) -> Window {
        Window::new(Some(instant(from)), Some(instant(until))).expect("a window")
    }

    fn zone(geometry: ZoneGeometry, change: impl FnOnce(&mut ZoneDraft)) -> Closure {
        let mut draft = ZoneDraft {
            id: "z".to_owned(),
            name: None,
            reason: None,
            authority: None,
            geometry,
            band: AltitudeBand::UNLIMITED,
            windows: Vec::new(),
            margin_m: 0.0,
            terms: Default::default(),
        };
        change(&mut draft);
        let zone = Zone::new(draft, &Frame::Planar).expect("a zone");
        Closure {
            id: "z".to_owned(),
            windows: zone.windows().to_vec(),
            hits: super::super::Hits::default(),
            pads: Vec::new(),
            cause: super::super::Cause::Zone(Arc::new(zone)),
        }
    }

    fn circle(x: f64, radius_m: f64) -> ZoneGeometry {
        let centre = [x, 0.0];
        ZoneGeometry::Circle { centre, radius_m }
    }

    fn square(half: f64) -> ZoneGeometry {
        let ring = vec![
            [-half, -half],
            [half, -half],
            [half, half],
            [-half, half],
            [-half, -half],
        ];
        ZoneGeometry::Polygon(vec![ring])
    }

    #[test]
    fn a_wider_shape_encloses_a_narrower_one_and_not_the_other_way() {
        let same = |_: &mut ZoneDraft| {};
        let pairs = [
            (circle(0.0, 50.0), circle(10.0, 40.0)),
            (square(50.0), square(40.0)),
            (square(50.0), circle(0.0, 49.0)),
            (circle(0.0, 60.0), square(40.0)),
        ];
        for (wide, narrow) in pairs {
            let (wide, narrow) = (zone(wide, same), zone(narrow, same));
            assert!(wide.encloses(&narrow, instant(6)), "{wide:?}");
            assert!(!narrow.encloses(&wide, instant(6)), "{narrow:?}");
            assert!(wide.encloses(&wide, instant(6)));
        }
        let moved = zone(circle(30.0, 50.0), same);
        assert!(!moved.encloses(&zone(circle(0.0, 50.0), same), instant(6)));
        let widened = zone(circle(0.0, 50.0), |draft| draft.margin_m = 20.0);
        assert!(widened.encloses(&zone(circle(0.0, 60.0), same), instant(6)));
    }

    #[test]
    fn bands_and_windows_count_as_far_as_they_are_ahead() {
        let at = |windows: Vec<Window>| zone(circle(0.0, 9.0), |draft| draft.windows = windows);
        let always = at(Vec::new());
        let long = at(vec![window(8, 12)]);
        let short = at(vec![window(9, 11)]);
        assert!(always.encloses(&long, instant(6)) && !long.encloses(&always, instant(6)));
        assert!(long.encloses(&short, instant(6)) && !short.encloses(&long, instant(6)));
        // What is over cannot be opened any more.
        assert!(short.encloses(&at(vec![window(8, 11)]), instant(9)));
        assert!(!short.encloses(&at(vec![window(8, 11)]), instant(8)));
        let low = zone(circle(0.0, 9.0), |draft| {
            draft.band.upper = Some(Altitude::agl(100.0));
        });
        assert!(always.encloses(&low, instant(6)) && !low.encloses(&always, instant(6)));
    }
}
