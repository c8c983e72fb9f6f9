//! When the sun rises and sets over a zone.

use jiff::civil::Date;
use jiff::tz::Offset;
use jiff::{SignedDuration, Timestamp};
use solar_positioning::{Horizon, Location, SolarEvents};

/// Terrestrial time less universal time, in seconds: about 69 in the 2020s, and a second more or
/// less moves no event by more.
const DELTA_T_S: f64 = 69.0;
/// The Julian date of 1970-01-01T00:00Z.
const UNIX_EPOCH_JULIAN: f64 = 2_440_587.5;
const DAY_S: f64 = 86_400.0;
/// How fast the sun moves over longitudes, in seconds a degree.
const SECONDS_PER_DEGREE: f64 = 240.0;
/// Metres of a degree of latitude, rounded down so that a circle's extent is rounded up.
const DEGREE_M: f64 = 110_000.0;

/// An event of the sun, as ED-318 names them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SunEvent {
    /// Begin of morning civil twilight.
    MorningTwilight,
    /// Sunrise.
    Sunrise,
    /// Sunset.
    Sunset,
    /// End of evening civil twilight.
    EveningTwilight,
}

impl SunEvent {
    /// All of them, in the order of a day.
    pub const ALL: [Self; 4] = [
        Self::MorningTwilight,
        Self::Sunrise,
        Self::Sunset,
        Self::EveningTwilight,
    ];

    /// The code of ED-318.
    pub const fn code(self) -> &'static str {
        match self {
            Self::MorningTwilight => "BMCT",
            Self::Sunrise => "SR",
            Self::Sunset => "SS",
            Self::EveningTwilight => "EECT",
        }
    }

    fn is_rise(self) -> bool {
        matches!(self, Self::MorningTwilight | Self::Sunrise)
    }

    fn horizon(self) -> Horizon {
        match self {
            Self::MorningTwilight | Self::EveningTwilight => Horizon::CivilTwilight,
            Self::Sunrise | Self::Sunset => Horizon::SunriseSunset,
        }
    }
}

/// The box of longitudes and latitudes that a zone lies in, in degrees; at its corners events are
/// earliest and latest.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(super) struct Extent {
    min: [f64; 2],
    max: [f64; 2],
}

impl Extent {
    /// The box around positions, longitude first.
    pub(super) fn about(positions: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let none = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let (min, max) = positions.into_iter().fold(none, |(min, max), position| {
            let least = [min[0].min(position[0]), min[1].min(position[1])];
            let most = [max[0].max(position[0]), max[1].max(position[1])];
            (least, most)
        });
        Self { min, max }
    }

    /// The box around a circle.
    pub(super) fn about_circle(centre: [f64; 2], radius_m: f64) -> Self {
        let north_deg = radius_m / DEGREE_M;
        let east_deg = north_deg / centre[1].to_radians().cos().abs().max(0.01);
        let [lon, lat] = centre;
        Self::about([
            [lon - east_deg, lat - north_deg],
            [lon + east_deg, lat + north_deg],
        ])
    }

    pub(super) fn corners(&self) -> [[f64; 2]; 4] {
        let ([west, south], [east, north]) = (self.min, self.max);
        [[west, south], [east, south], [west, north], [east, north]]
    }
}

/// When an event takes place on a day at a longitude and latitude. The day is that of the mean
/// local solar time.
///
/// On a day without the event it is the begin or the end of that day, as is asked for.
pub(super) fn sun_time(
    event: SunEvent,
    day: Date,
    [lon_deg, lat_deg]: [f64; 2],
    begins: bool,
) -> Option<Timestamp> {
    let noon = Offset::UTC.to_timestamp(day.at(12, 0, 0, 0)).ok()?;
    let noon_s = noon.as_second() as f64 - lon_deg * SECONDS_PER_DEGREE;
    let half_day_s = DAY_S / 2.0;
    let location = Location {
        latitude: lat_deg.clamp(-90.0, 90.0),
        longitude: lon_deg.clamp(-180.0, 180.0),
    };
    let julian = |unix_s: f64| UNIX_EPOCH_JULIAN + unix_s / DAY_S;
    let events = SolarEvents::grena3();
    let (horizon, noon_julian) = (event.horizon(), julian(noon_s));
    let found = match event.is_rise() {
        true => {
            let midnight = julian(noon_s - half_day_s);
            events.next_rise_from_julian(midnight, noon_julian, location, DELTA_T_S, horizon)
        }
        false => {
            let midnight = julian(noon_s + half_day_s);
            events.next_set_from_julian(noon_julian, midnight, location, DELTA_T_S, horizon)
        }
    };
    let unix_s = match found {
        Ok(Some(julian)) => (julian - UNIX_EPOCH_JULIAN) * DAY_S,
        // Years that the algorithm does not cover are days without events.
        Ok(None) | Err(_) if begins => noon_s - half_day_s,
        Ok(None) | Err(_) => noon_s + half_day_s,
    };
    let since = SignedDuration::try_from_secs_f64(unix_s).ok()?;
    Timestamp::from_duration(since).ok()
}
