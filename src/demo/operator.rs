//! The operator: closes a circle now and then, where it meets most plans, and clears away what is over.

use super::client::{Client, ClientError};
use super::map::Map;
use super::script::{OperatorScript, PlannedZone};
use crate::clock::Clock;
use crate::wire;
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;
use tokio_util::sync::CancellationToken;

/// How long a zone that is over is still shown.
const SHOWN_AFTER: SignedDuration = SignedDuration::from_mins(1);
/// How long a wind is stated for.
const WIND_FOR: SignedDuration = SignedDuration::from_hours(1);
/// Before something that went wrong is tried again, in the machine's time.
const AGAIN_AFTER: Duration = Duration::from_secs(1);

/// An operator of airspace.
#[derive(Debug)]
pub(super) struct Operator {
    script: OperatorScript,
    map: Arc<Map>,
    client: Arc<Client>,
    /// The registry, where the wind is stated, and the network there.
    registry: (Client, String),
    clock: Clock,
    /// How many zones there were.
    put: u32,
    /// The zones that are there, and until when they are kept.
    zones: VecDeque<(String, Timestamp)>,
}

impl Operator {
    pub(super) fn new(
        script: OperatorScript,
        map: Arc<Map>,
        (client, registry): (Arc<Client>, (Client, String)),
        clock: Clock,
    ) -> Self {
        Self {
            script,
            map,
            client,
            registry,
            clock,
            put: 0,
            zones: VecDeque::new(),
        }
    }

    /// Works until it is told to stop. What goes wrong is logged; the next zone comes all the same.
    pub(super) async fn work(mut self, stop: CancellationToken) {
        self.turn_wind().await;
        loop {
            let done = tokio::select! {
                () = stop.cancelled() => return,
                done = self.next_zone() => done,
            };
            let Err(error) = done else {
                continue;
            };
            tracing::warn!(%error, "the demo's operator goes on with the next zone");
            tokio::select! {
                () = stop.cancelled() => return,
                () = tokio::time::sleep(AGAIN_AFTER) => {}
            }
        }
    }

    async fn next_zone(&mut self) -> Result<(), ClientError> {
        let planned = self.script.zone(&self.map);
        let due = self.clock.now().saturating_add(planned.wait);
        let due = due.unwrap_or(Timestamp::MAX);
        self.clear_until(due).await?;
        self.clock.sleep_until(due).await;
        self.turn_wind().await;
        let mut chosen: Option<(usize, Value)> = None;
        self.put += 1;
        for &place in &planned.places {
            let feature = self.feature(&planned, place);
            let met = self.client.preview_zone(&feature).await?.effect.plan_count;
            let meets_more = chosen.as_ref().is_none_or(|(most, _)| met > *most);
            if meets_more {
                chosen = Some((met, feature));
            }
        }
        let Some((_, feature)) = chosen else {
            return Ok(());
        };
        self.client.post_zone(&feature).await?;
        let kept = planned.life.saturating_add(SHOWN_AFTER);
        let until = self.clock.now().saturating_add(kept);
        self.zones
            .push_back((self.id(), until.unwrap_or(Timestamp::MAX)));
        Ok(())
    }

    /// States the wind anew, well beyond the next time. While the registry is away it stays as it is.
    async fn turn_wind(&mut self) {
        let (speed_mps, from_deg) = self.script.wind();
        let now = self.clock.now();
        let until = now.saturating_add(WIND_FOR).unwrap_or(Timestamp::MAX);
        let wind = wire::Wind {
            area: None,
            from: now.to_string(),
            until: until.to_string(),
            speed_mps,
            from_deg,
        };
        let weather = wire::Weather { wind: vec![wind] };
        let (registry, network) = &self.registry;
        if let Err(error) = registry.put_weather(network, &weather).await {
            tracing::info!(%error, "the demo's wind stays as it is");
        }
    }

    /// Deletes the zones that are over, until it is time for the next one.
    async fn clear_until(&mut self, due: Timestamp) -> Result<(), ClientError> {
        while let Some(place) = self.zones.iter().position(|(_, until)| *until <= due) {
            let (id, until) = self.zones[place].clone();
            self.clock.sleep_until(until).await;
            match self.client.delete_zone(&id).await {
                Ok(()) => {}
                // Somebody else has lifted it, on the page perhaps.
                Err(error) if error.is_missing() => {}
                Err(error) => return Err(error),
            }
            self.zones.remove(place);
        }
        Ok(())
    }

    fn id(&self) -> String {
        format!("demo-zone-{}", self.put)
    }

    fn feature(&self, planned: &PlannedZone, place: usize) -> Value {
        let now = self.clock.now();
        let until = now.saturating_add(planned.life).unwrap_or(Timestamp::MAX);
        json!({
            "type": "Feature",
            "id": self.id(),
            "geometry": {
                "type": "Point",
                "coordinates": self.map.coordinates(self.map.position(place)),
            },
            "properties": {
                "name": format!("Demo zone {}", self.put),
                "reason": planned.reason,
                "radius_m": planned.radius_m,
                "windows": [{"from": now.to_string(), "until": until.to_string()}],
            },
        })
    }
}
