//! Zones as operators send them.

use super::fields::Faults;
use crate::airspace::Zone;
use crate::formats::{ZoneId, zone_from_feature};
use crate::geo::Frame;
use crate::refusal::{Code, Refusal};
use serde_json::{Value, json};

/// Reads a zone; one that states no margin gets this one, in metres.
///
/// # Errors
/// Everything wrong with it.
pub fn read_zone(
    mut feature: Value,
    id: ZoneId<'_>,
    frame: &Frame,
    margin_m: f64,
) -> Result<Zone, Refusal> {
    widen_by_default(&mut feature, margin_m);
    let zone = zone_from_feature(&feature, id, frame).map_err(Refusal::of_zone)?;
    let mut faults = Faults::default();
    faults.no_step("zone_id_invalid", "/id", zone.id());
    faults.check(Code::ZoneInvalid, "zone")?;
    Ok(zone)
}

/// Puts in the margin where a zone states none.
fn widen_by_default(feature: &mut Value, margin_m: f64) {
    let Some(members) = feature.as_object_mut() else {
        return;
    };
    let properties = members.entry("properties").or_insert(Value::Null);
    if properties.is_null() {
        *properties = json!({});
    }
    if let Some(properties) = properties.as_object_mut() {
        let margin = properties.entry("margin_m").or_insert(Value::Null);
        if margin.is_null() {
            *margin = json!(margin_m);
        }
    }
}
