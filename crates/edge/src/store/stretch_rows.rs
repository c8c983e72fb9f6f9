//! First stretches of versions in rows of plans.

use super::codec::{Dictionary, Places};
use super::file::StoreFault;
use crate::plans::stretches::Stretch;
use serde::{Deserialize, Serialize};
use skyway_engine::flight::{FirstStretch, Reentry, StretchKind, StretchLeg};
use skyway_engine::network::Topology;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StoredStretch {
    node: u32,
    /// The leg that it runs on; one that runs straight has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    leg: Option<(u32, u32, f64)>,
    length_m: f64,
    overrun_m: f64,
    /// Where it begins, as clients write places.
    begin: [f64; 2],
    knew: Vec<String>,
}

pub(super) fn store_stretch(
    topology: &Topology,
    stretch: &Stretch,
    dictionary: &mut Dictionary,
) -> StoredStretch {
    let Reentry { node, stretch: way } = stretch.reentry;
    StoredStretch {
        node: dictionary.place(node),
        leg: way.leg.map(|leg| {
            let [from, to] = [leg.from, leg.to].map(|node| dictionary.place(node));
            (from, to, leg.fraction)
        }),
        length_m: way.length_m,
        overrun_m: way.overrun_m,
        begin: topology.frame().from_plane(way.begin),
        knew: stretch.knew.clone(),
    }
}

pub(super) fn read_stretch(
    topology: &Topology,
    places: Places<'_>,
    stored: &StoredStretch,
) -> Result<Stretch, StoreFault> {
    let leg = stored.leg.map(|(from, to, fraction)| {
        let (from, to) = (places.node(from)?, places.node(to)?);
        Ok(StretchLeg {
            from,
            to,
            segment: topology.segment_between(from, to),
            fraction,
        })
    });
    let leg = leg.transpose()?;
    Ok(Stretch {
        reentry: Reentry {
            node: places.node(stored.node)?,
            stretch: FirstStretch {
                kind: match leg {
                    Some(_) => StretchKind::Leg,
                    None => StretchKind::Straight,
                },
                leg,
                length_m: stored.length_m,
                overrun_m: stored.overrun_m,
                begin: topology.frame().to_plane(stored.begin),
            },
        },
        knew: stored.knew.clone(),
    })
}
