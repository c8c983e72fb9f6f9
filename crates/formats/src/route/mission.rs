//! Missions of QGroundControl. Heights above sea are written as they are; heights above ground
//! relative to where the drone takes off, which is the same on level ground alone, so that a note
//! says so. Rally points have no frame: ground stations read their heights above home.

use super::{Corner, RouteProblem, Told, WrittenRoute, lines};
use crate::airspace::ZoneGeometry;
use crate::geo::{Altitude, AltitudeReference, Point};
use serde_json::{Value, json};

/// PX4, and a multicopter.
const FIRMWARE: u32 = 12;
const VEHICLE: u32 = 2;
/// Commands of MAVLink: fly to, land, take off, set the speed.
const WAYPOINT: u32 = 16;
const LAND: u32 = 21;
const TAKE_OFF: u32 = 22;
const CHANGE_SPEED: u32 = 178;
/// Frames of MAVLink: above sea, none, above home.
const ABOVE_SEA: u32 = 0;
const NO_FRAME: u32 = 2;
const ABOVE_HOME: u32 = 3;
const GROUND_SPEED: f64 = 1.0;
const UNCHANGED: f64 = -1.0;

/// One command.
struct Item {
    command: u32,
    frame: u32,
    /// `None` keeps what is.
    params: [Option<f64>; 7],
}

/// A mission with where it begins.
struct Mission {
    items: Vec<Item>,
    /// Latitude, longitude, and metres above sea.
    home: [f64; 3],
    notes: Vec<String>,
    frame: u32,
    /// The altitude of home by the reference of the route.
    home_altitude: Altitude,
    /// What is subtracted of heights.
    zero_m: f64,
}

pub(super) fn plan(told: &Told<'_>) -> Result<WrittenRoute, RouteProblem> {
    let mut mission = mission(told)?;
    let items: Vec<Value> = (1..)
        .zip(&mission.items)
        .map(|(number, item)| item_value(number, item))
        .collect();
    let fence = fence(told, &mut mission.notes);
    let rally = rally_points(told, mission.home_altitude, &mut mission.notes);
    let speed_mps = told.route.speed_mps;
    let plan = json!({
        "fileType": "Plan",
        "version": 1,
        "groundStation": "skyway",
        "mission": {
            "version": 2,
            "firmwareType": FIRMWARE,
            "vehicleType": VEHICLE,
            "cruiseSpeed": speed_mps,
            "hoverSpeed": speed_mps,
            "globalPlanAltitudeMode": altitude_mode(mission.frame),
            "plannedHomePosition": mission.home,
            "items": items,
        },
        "geoFence": fence,
        "rallyPoints": {"version": 2, "points": rally},
    });
    Ok(WrittenRoute {
        text: format!("{plan:#}\n"),
        notes: mission.notes,
    })
}

pub(super) fn waypoints(told: &Told<'_>) -> Result<WrittenRoute, RouteProblem> {
    let mission = mission(told)?;
    let [lat, lon, above_sea_m] = mission.home;
    let mut lines = vec![
        "QGC WPL 110".to_owned(),
        format!("0\t1\t{ABOVE_SEA}\t{WAYPOINT}\t0\t0\t0\t0\t{lat}\t{lon}\t{above_sea_m}\t1"),
    ];
    for (number, item) in (1..).zip(&mission.items) {
        let params = item
            .params
            .map(|param| param.unwrap_or_default().to_string());
        let (frame, command) = (item.frame, item.command);
        lines.push(format!(
            "{number}\t0\t{frame}\t{command}\t{}\t1",
            params.join("\t")
        ));
    }
    lines.push(String::new());
    Ok(WrittenRoute {
        text: lines.join("\n"),
        notes: mission.notes,
    })
}

fn mission(told: &Told<'_>) -> Result<Mission, RouteProblem> {
    let reference = match told.reference {
        Some(reference) => reference,
        None if told.corners.iter().all(|corner| corner.height_m.is_some()) => {
            return Err(RouteProblem::OtherReference);
        }
        None => return Err(RouteProblem::NoHeights),
    };
    let start = told.route.legs.first().ok_or(RouteProblem::Empty)?.from;
    let ([lon, lat], altitude) = told.place(start);
    let altitude = altitude.ok_or(RouteProblem::NoHeights)?;
    if altitude.reference != reference {
        return Err(RouteProblem::OtherReference);
    }
    let mut mission = Mission {
        items: Vec::new(),
        home: [lat, lon, 0.0],
        notes: Vec::new(),
        frame: ABOVE_HOME,
        home_altitude: altitude,
        zero_m: altitude.value_m,
    };
    match reference {
        AltitudeReference::Amsl => {
            mission.home[2] = altitude.value_m;
            mission.frame = ABOVE_SEA;
            mission.zero_m = 0.0;
        }
        AltitudeReference::Agl => {
            let note = "heights above ground are written above the place of take-off, which is the same on level ground";
            mission.notes.push(note.to_owned());
        }
        AltitudeReference::Wgs84 => return Err(RouteProblem::OtherReference),
    }
    let speed = told.route.speed_mps;
    let mut on_ground = told.route.lead_in.is_empty();
    for corner in &told.corners {
        let height_m = corner.height_m.ok_or(RouteProblem::NoHeights)?;
        let command = if on_ground { TAKE_OFF } else { WAYPOINT };
        mission.fly(command, corner, height_m);
        if mission.items.len() == 1 {
            let params = [GROUND_SPEED, speed, UNCHANGED, 0.0, 0.0, 0.0, 0.0].map(Some);
            mission.items.push(Item {
                command: CHANGE_SPEED,
                frame: NO_FRAME,
                params,
            });
        }
        on_ground = corner.lands;
        if corner.lands {
            let roof = corner
                .node
                .and_then(|node| told.topology.node_altitude(node));
            let roof = roof.filter(|roof| roof.reference == reference);
            let roof_m = roof.ok_or(RouteProblem::NoHeights)?.value_m;
            mission.fly(LAND, corner, roof_m);
        }
    }
    let landings = told.route.legs.iter().filter(|leg| leg.lands).count();
    if landings > 1 {
        let note = "how long the drone recharges where it lands on the way is not in the mission";
        mission.notes.push(note.to_owned());
    }
    Ok(mission)
}

impl Mission {
    fn fly(&mut self, command: u32, corner: &Corner, height_m: f64) {
        let [lon, lat] = corner.lon_lat;
        let height_m = height_m - self.zero_m;
        let params = [
            Some(0.0),
            Some(0.0),
            Some(0.0),
            None,
            Some(lat),
            Some(lon),
            Some(height_m),
        ];
        self.items.push(Item {
            command,
            frame: self.frame,
            params,
        });
    }
}

fn altitude_mode(frame: u32) -> u32 {
    match frame {
        ABOVE_SEA => 2,
        _ => 1,
    }
}

fn item_value(number: u32, item: &Item) -> Value {
    let mut told = json!({
        "type": "SimpleItem",
        "command": item.command,
        "frame": item.frame,
        "params": item.params,
        "autoContinue": true,
        "doJumpId": number,
    });
    if item.frame != NO_FRAME {
        told["AltitudeMode"] = json!(altitude_mode(item.frame));
        told["Altitude"] = json!(item.params[6]);
        told["AMSLAltAboveTerrain"] = Value::Null;
    }
    told
}

/// The alternates as latitude, longitude, and metres above home.
fn rally_points(told: &Told<'_>, home: Altitude, notes: &mut Vec<String>) -> Vec<[f64; 3]> {
    let mut points = Vec::with_capacity(told.alternates.len());
    for &node in &told.alternates {
        let ([lon, lat], altitude) = told.place(node);
        match altitude.filter(|altitude| altitude.reference == home.reference) {
            Some(altitude) => points.push([lat, lon, altitude.value_m - home.value_m]),
            None => {
                let id = told.topology.node_id(node);
                notes.push(format!(
                    "the alternate '{id}' is left out: its height above home is unknown"
                ));
            }
        }
    }
    points
}

/// What the drone stays out of: it has no heights and no times, so that only what counts on the way
/// is in it.
fn fence(told: &Told<'_>, notes: &mut Vec<String>) -> Value {
    let (mut polygons, mut circles) = (Vec::new(), Vec::new());
    let lines = lines(told.topology, &told.corners);
    for zone in &told.fences {
        let is_met = |&(from, to): &(Point, Point)| zone.shape().meets_segment(from, to, 0.0);
        if lines.iter().any(is_met) {
            let id = zone.id();
            notes.push(format!(
                "the route lies in the fence of zone '{id}', which an autopilot may refuse"
            ));
        }
        let rings: Vec<&Vec<Vec<[f64; 2]>>> = match zone.geometry() {
            ZoneGeometry::Circle { centre, radius_m } => {
                let center = [centre[1], centre[0]];
                circles.push(json!({
                    "version": 1,
                    "inclusion": false,
                    "circle": {"center": center, "radius": radius_m},
                }));
                continue;
            }
            ZoneGeometry::Polygon(rings) => vec![rings],
            ZoneGeometry::MultiPolygon(polygons) => polygons.iter().collect(),
        };
        for rings in rings {
            let (Some(outer), holes) = (rings.first(), rings.len() - 1) else {
                continue;
            };
            if holes > 0 {
                let id = zone.id();
                notes.push(format!(
                    "the fence has no holes: zone '{id}' is closed as a whole in it"
                ));
            }
            let open = &outer[..outer.len().saturating_sub(1)];
            let positions: Vec<[f64; 2]> = open.iter().map(|[lon, lat]| [*lat, *lon]).collect();
            polygons.push(json!({"version": 1, "inclusion": false, "polygon": positions}));
        }
    }
    json!({"version": 2, "polygons": polygons, "circles": circles})
}
