//! Which edge of a network is asked for flights, and where it is reached.

use super::Dispatch;
use super::edges::EdgeAddress;
use jiff::SignedDuration;
use skyway_service::refusal::{Code, Refusal};

/// An edge that was heard within this time is asked before others.
const HEARD_WITHIN: SignedDuration = SignedDuration::from_secs(60);

impl Dispatch {
    /// The edge that flights over a network are asked of: the first by id that was heard lately, else the one heard last.
    ///
    /// # Errors
    /// When no edge of the network takes flights.
    pub(super) async fn edge_of(&self, network: &str) -> Result<EdgeAddress, Refusal> {
        let now_ms = self.clock.now().as_millisecond();
        let heard = self.registry.edges_of(network).await?.into_iter();
        let reached = heard.filter_map(|edge| {
            let url = edge.url.filter(|url| !url.is_empty())?;
            let age_ms = now_ms.saturating_sub(edge.heard_ms);
            let is_late = i128::from(age_ms) > HEARD_WITHIN.as_millis();
            let rank = if is_late { age_ms } else { 0 };
            let edge = EdgeAddress { id: edge.edge, url };
            self.edges.may_ask(&edge).then_some((rank, edge))
        });
        let first = reached.min_by(|one, other| (one.0, &one.1.id).cmp(&(other.0, &other.1.id)));
        first.map(|(_, edge)| edge).ok_or_else(|| {
            let detail = format!("no edge of the network '{network}' takes flights just now");
            Refusal::new(Code::EdgeUnavailable, detail).retry_after_s(5)
        })
    }

    /// An edge of a network by its id.
    ///
    /// # Errors
    /// When the store does not answer, or it is not known where the edge is reached.
    pub(super) async fn edge_by_id(&self, network: &str, id: &str) -> Result<EdgeAddress, Refusal> {
        let heard = self.registry.edges_of(network).await?;
        let edge = heard.into_iter().find(|edge| edge.edge == id);
        let url = edge.and_then(|edge| edge.url).filter(|url| !url.is_empty());
        let url = url.ok_or_else(|| {
            let detail = format!("it is not known where the edge '{id}' is reached");
            Refusal::new(Code::EdgeUnavailable, detail).retry_after_s(5)
        })?;
        let id = id.to_owned();
        Ok(EdgeAddress { id, url })
    }
}
