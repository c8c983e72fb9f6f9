//! The weather: wind over the network, as one document.

use crate::Edge;
use crate::snapshot::Snapshot;
use crate::words::weather_etag;
use crate::writer::commands::{Command, Done, unexpected};
use skyway_contract as wire;
use skyway_service::access::Caller;
use skyway_service::intake::{Expected, read_weather};
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;

impl Edge {
    /// The weather as it is stated.
    pub fn weather(&self, _caller: &Caller) -> wire::WeatherAnswer<'static> {
        self.weather_of(&self.snapshot())
    }

    /// States the weather, as a whole.
    ///
    /// # Errors
    /// When it is not valid, `If-Match` is missing or stale where weather is stated, or a registry is followed.
    pub async fn put_weather(
        &self,
        caller: &Caller,
        weather: wire::Weather,
        if_match: Option<String>,
    ) -> Result<wire::WeatherAnswer<'static>, Refusal> {
        if self.settings.follows_registry {
            let detail = "this edge has its weather from the registry, where an operator puts it for all edges: PUT \
                          /v1/networks/{network}/weather";
            return Err(Refusal::new(Code::WeatherElsewhere, detail));
        }
        let on = self.on_network()?;
        read_weather(&weather, on.topology().frame())?;
        // Texts and finite numbers always have a JSON form.
        let text = serde_json::to_string(&weather).unwrap_or_default();
        let command = Command::PutWeather {
            text: Arc::from(text),
            expected: Expected::of(if_match),
        };
        let (outcome, snapshot) = self.command(command.by(caller)).await?;
        match outcome.done {
            Done::Nothing => Ok(self.weather_of(&snapshot)),
            _ => Err(unexpected()),
        }
    }

    fn weather_of(&self, snapshot: &Snapshot) -> wire::WeatherAnswer<'static> {
        let text = snapshot.weather.as_deref();
        let weather: Option<wire::Weather> = text.and_then(|text| serde_json::from_str(text).ok());
        wire::WeatherAnswer {
            wind: weather.unwrap_or_default().wind,
            etag: text.map(|text| weather_etag(text).into()),
            stamp: self.stamp_of(snapshot),
        }
    }
}
