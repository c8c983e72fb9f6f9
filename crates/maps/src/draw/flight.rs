//! A plan with times and battery on the map: the battery along the way, recharging stops, the wind.

use super::labels::Labeller;
use super::legend::{Legend, Sample};
use super::marks::{Mark, draw_cross, draw_mark, draw_mark_towards};
use super::picture::DrawnFlight;
use super::style::{INK, NEW_PATH_EDGE, QUIET_INK};
use super::svg::{Document, PathData, Px, Spot};
use super::view::View;
use crate::flight::{Stop, StopKind};
use crate::network::{NodeIx, Topology};

/// Classes of battery on arrival: from which fraction on, colour, and width in pixels. What is fuller is drawn broader.
const CLASSES: [(f64, &str, f64); 4] = [
    (0.75, "#08519c", 5.6),
    (0.5, "#3182bd", 4.6),
    (0.25, "#e69f00", 3.6),
    (f64::NEG_INFINITY, "#d55e00", 2.6),
];
/// The leg that failed; vermilion is a low battery here.
const FAILED_LEG: &str =
    r##"fill="none" stroke="#5f6368" stroke-width="2.4" stroke-dasharray="6 4""##;
/// Length of the arrow of the wind, in pixels, by metres per second, and its bounds.
const ARROW_PX_PER_MPS: f64 = 4.0;
const SHORTEST_ARROW_PX: f64 = 14.0;
const LONGEST_ARROW_PX: f64 = 48.0;
/// Wind below this, in metres per second, is calm.
const CALM_MPS: f64 = 0.05;

/// A plan laid on the map.
pub(super) struct Course<'a> {
    drawn: &'a DrawnFlight<'a>,
    view: &'a View,
    places: Vec<Spot>,
    stops: Vec<(&'a Stop, Spot)>,
    failed_leg: Option<[Spot; 2]>,
    drone: Option<Spot>,
}

impl<'a> Course<'a> {
    pub(super) fn new(topology: &Topology, drawn: &'a DrawnFlight<'a>, view: &'a View) -> Self {
        let place = |node: NodeIx| view.place(topology.position(node));
        let drone = drawn.drone.filter(|drone| drone.is_finite());
        let stops = drawn.plan.stops.iter();
        Self {
            drawn,
            view,
            places: drawn.nodes.iter().map(|&node| place(node)).collect(),
            stops: stops.map(|stop| (stop, place(stop.node))).collect(),
            failed_leg: drawn.failed_leg.map(|(from, to)| [place(from), place(to)]),
            drone: drone.map(|drone| view.place(drone)),
        }
    }

    /// The legs, each in the colour and width of the battery at its end.
    pub(super) fn draw_legs(&self, map: &mut Document, legend: &mut Legend) {
        if let Some(leg) = self.failed_leg {
            map.path(&PathData::through(leg, false), format_args!("{FAILED_LEG}"));
            legend.add(Sample::CrossedLine(FAILED_LEG), "failed leg");
        }
        if self.places.len() > 1 {
            let whole = PathData::through(self.places.iter().copied(), false);
            map.path(&whole, format_args!("{NEW_PATH_EDGE}"));
        }
        for (class, &(from, colour, width)) in CLASSES.iter().enumerate() {
            let below = match class.checked_sub(1) {
                Some(fuller) => CLASSES[fuller].0,
                None => f64::INFINITY,
            };
            let mut data = PathData::default();
            let mut seen = false;
            let legs = self.places.windows(2).zip(&self.drawn.plan.legs);
            for (ends, leg) in legs {
                if (from..below).contains(&leg.battery_after) {
                    data.add([ends[0], ends[1]], false);
                    seen = true;
                }
            }
            if !seen {
                continue;
            }
            let style = format!(
                "fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linecap=\"round\""
            );
            map.path(&data, format_args!("{style}"));
            legend.add(Sample::Lines(vec![style]), class_words(from, below));
        }
        let rings = self.places.iter().copied();
        let mut data = PathData::default();
        for place in rings {
            data.circle(place, 1.8);
        }
        map.path(
            &data,
            format_args!("fill=\"#ffffff\" stroke=\"{INK}\" stroke-width=\"0.8\""),
        );
    }

    /// Stops, ends, and where the drone was.
    pub(super) fn draw_marks(&self, map: &mut Document, legend: &mut Legend) {
        for &(_, place) in &self.stops {
            draw_mark(Mark::Stop, place, map);
        }
        if !self.stops.is_empty() {
            legend.add(
                Sample::Mark(Mark::Stop),
                "stop, with the battery at landing and take-off",
            );
        }
        if let (Some(&first), Some(&last)) = (self.places.first(), self.places.last()) {
            draw_mark(Mark::Start, first, map);
            legend.add(Sample::Mark(Mark::Start), "start");
            draw_mark(Mark::Destination, last, map);
            legend.add(Sample::Mark(Mark::Destination), "end of the plan");
        }
        if let Some([from, to]) = self.failed_leg {
            draw_cross(from.towards(to, 0.5), map);
            if let Some(drone) = self.drone {
                let ahead = drone.moved(to.x - from.x, to.y - from.y);
                draw_mark_towards(Mark::Drone, drone, ahead, map);
                legend.add(Sample::Mark(Mark::Drone), "drone when it reported");
            }
        }
    }

    /// An arrow in the upper right corner, the way the wind blows, with its speed; nothing where it is calm.
    pub(super) fn draw_wind(&self, map: &mut Document) {
        let wind = self.drawn.wind;
        let speed_mps = wind.speed_mps();
        if speed_mps < CALM_MPS {
            return;
        }
        let centre = Spot::new(self.view.width_px - 40.0, 40.0);
        map.path(
            &circle(centre, 30.0),
            format_args!(
                "fill=\"#ffffff\" fill-opacity=\"0.85\" stroke=\"{QUIET_INK}\" stroke-width=\"0.8\""
            ),
        );
        let half_px =
            (speed_mps * ARROW_PX_PER_MPS).clamp(SHORTEST_ARROW_PX, LONGEST_ARROW_PX) / 2.0;
        let (east, south) = (wind.east_mps / speed_mps, -wind.north_mps / speed_mps);
        let tip = centre.moved(east * half_px, south * half_px);
        let tail = centre.moved(-east * half_px, -south * half_px);
        let wing = |side: f64| {
            let foot = tip.moved(-east * 8.0, -south * 8.0);
            foot.moved(-south * side, east * side)
        };
        map.path(
            &PathData::through([tail, tip], false),
            format_args!("fill=\"none\" stroke=\"{INK}\" stroke-width=\"2\""),
        );
        map.path(
            &PathData::through([tip, wing(4.5), wing(-4.5)], true),
            format_args!("fill=\"{INK}\""),
        );
        let (x, y) = (Px(centre.x), Px(centre.y + 44.0));
        map.words(
            "text",
            format_args!(
                "x=\"{x}\" y=\"{y}\" text-anchor=\"middle\" stroke=\"#ffffff\" stroke-width=\"3\" paint-order=\"stroke\""
            ),
            &format!("wind {speed_mps:.1} m/s"),
        );
    }

    /// What stands beside each stop.
    pub(super) fn name_stops(&self, labeller: &mut Labeller<'_>) {
        for &(stop, place) in &self.stops {
            let percent = |fraction: f64| (100.0 * fraction).round();
            let (before, after) = (percent(stop.battery_before), percent(stop.battery_after));
            let words = match (stop.kind, before < after) {
                (StopKind::Start, false) => "waits".to_owned(),
                _ => format!("{before} → {after} %"),
            };
            labeller.name_stop(place, &words);
        }
    }

    /// Keeps labels off the way and the wind.
    pub(super) fn occupy(&self, labeller: &mut Labeller<'_>) {
        labeller.occupy_line(&self.places);
        for &place in &self.places {
            labeller.occupy(place, 4.0);
        }
        for &(_, place) in &self.stops {
            labeller.occupy(place, 7.0);
        }
        if self.drawn.wind.speed_mps() >= CALM_MPS {
            labeller.occupy(Spot::new(self.view.width_px - 40.0, 46.0), 44.0);
        }
    }
}

fn circle(centre: Spot, radius_px: f64) -> PathData {
    let mut data = PathData::default();
    data.circle(centre, radius_px);
    data
}

fn class_words(from: f64, below: f64) -> String {
    let percent = |fraction: f64| 100.0 * fraction;
    match (from.is_finite(), below.is_finite()) {
        (true, true) => format!("battery {} to {} %", percent(from), percent(below)),
        (true, false) => format!("battery above {} %", percent(from)),
        (false, _) => format!("battery below {} %", percent(below)),
    }
}
