//! The network that a page is worked out on: the one in service, or the one that the page brings.

use crate::network::replacement::NewNetwork;
use crate::upstream::published::BodyFault;

use bytes::Bytes;
use skyway_contract::{ChangeOperation, NetworkPatch, ObjectKind};
use skyway_engine::network::{NetworkDraft, Topology};
use skyway_formats::{fingerprint, patch_network, read_network, write_network};
use std::sync::Arc;

/// A network with what it was read from.
#[derive(Clone, Debug)]
pub(crate) struct BaseNetwork {
    pub(crate) topology: Arc<Topology>,
    pub(crate) geojson: Bytes,
}

fn invalid(reason: impl ToString) -> BodyFault {
    BodyFault::of(ObjectKind::Network, reason)
}

fn read(text: &str) -> Result<NetworkDraft, BodyFault> {
    read_network(text).map_err(|errors| {
        let first = errors.first().map(ToString::to_string);
        invalid(first.unwrap_or_default())
    })
}

impl BaseNetwork {
    /// The network that changes in their order make of this one; none where it is the same.
    ///
    /// # Errors
    /// When one of them cannot be read, does not fit, or leaves a network that cannot be flown.
    pub(crate) fn changed<'a>(
        &self,
        changes: impl IntoIterator<Item = (ChangeOperation, &'a str)>,
    ) -> Result<Option<NewNetwork>, BodyFault> {
        let mut whole: Option<&str> = None;
        let mut patches: Vec<&str> = Vec::new();
        for (operation, body) in changes {
            match operation {
                ChangeOperation::Put => {
                    whole = Some(body);
                    patches.clear();
                }
                ChangeOperation::Patch => patches.push(body),
                ChangeOperation::Delete => return Err(invalid("a network is never lifted")),
            }
        }
        if patches.is_empty() && whole.is_none_or(|text| self.is(text)) {
            return Ok(None);
        }
        let own = std::str::from_utf8(&self.geojson).map_err(invalid)?;
        let mut draft = read(whole.unwrap_or(own))?;
        for patch in &patches {
            let patch: NetworkPatch = serde_json::from_str(patch).map_err(invalid)?;
            draft = patch_network(&draft, &patch).map_err(|errors| {
                let first = errors.first().map(ToString::to_string);
                invalid(first.unwrap_or_default())
            })?;
        }
        let text = match (whole, patches.is_empty()) {
            (Some(text), true) => text.to_owned(),
            _ => write_network(&draft),
        };
        // The same network may be written in another way.
        if read(own).is_ok_and(|own| own == draft) {
            return Ok(None);
        }
        let topology = Topology::build(draft, fingerprint(&[&text])).map_err(|errors| {
            let first = errors.first().map(ToString::to_string);
            invalid(first.unwrap_or_default())
        })?;
        let network = NewNetwork::new(Arc::new(topology), Bytes::from(text));
        Ok(Some(network))
    }

    fn is(&self, text: &str) -> bool {
        fingerprint(&[text]) == *self.topology.fingerprint()
    }
}
