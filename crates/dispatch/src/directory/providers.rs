//! Providers: who runs drones and sells deliveries.

use super::{CONTACT_BYTES_MAX, Checked, Entry, Place, check_name, check_repeated, tenant_named};
use crate::Dispatch;
use skyway_contract::{Provider, ProviderState};
use skyway_registry::documents::DocumentKind;
use skyway_service::access::{Caller, Role};
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};

/// How a provider stands in the store that an operator has suspended.
const SUSPENDED_BY_OPERATOR: &str = "suspended_by_operator";

impl Entry for Provider {
    const KIND: DocumentKind = DocumentKind::Provider;
    const IS_OFFERED: bool = true;
    const OF_TENANT_MAX: u64 = 1;
    const MAX: u64 = 10_000;

    fn tenant(&self, caller: &Caller, id: &str) -> Result<String, Refusal> {
        tenant_named(caller, Self::KIND, id)
    }

    fn checked<'a>(
        mut self,
        _dispatch: &'a Dispatch,
        place: Place<'a>,
        _before: Option<&'a Self>,
    ) -> Checked<'a, Self> {
        let mut faults = Faults::default();
        check_repeated(&mut faults, "/id", self.id.as_deref(), place.id);
        check_name(&mut faults, &self.name);
        faults.text("/contact", self.contact.as_deref(), CONTACT_BYTES_MAX);
        self.id = Some(place.id.to_owned());
        let mut checked = faults.check(Code::BodyInvalid, Self::KIND.name());
        if self.state == ProviderState::Active {
            checked = checked.and_then(|()| check_lifted(place));
        }
        Box::pin(async move { checked.map(|()| self) })
    }

    fn state(&self, place: Place<'_>) -> &'static str {
        let is_own = place.caller.role == Role::Provider && place.stood != SUSPENDED_BY_OPERATOR;
        match self.state {
            ProviderState::Active => "active",
            ProviderState::Suspended if is_own => "suspended",
            ProviderState::Suspended => SUSPENDED_BY_OPERATOR,
        }
    }

    fn shown(mut self, caller: &Caller, tenant: &str) -> Self {
        let is_told = match caller.role {
            Role::Operator | Role::Anyone => true,
            Role::Provider => *caller.tenant == *tenant,
            Role::Customer | Role::Drone | Role::Edge | Role::Metrics => false,
        };
        if !is_told {
            self.contact = None;
        }
        self
    }

    /// A provider that has drones or services still has something to deliver with.
    fn check_unused<'a>(&'a self, dispatch: &'a Dispatch, place: Place<'a>) -> Checked<'a, ()> {
        Box::pin(async move {
            // Else it would come back active.
            check_lifted(place)?;
            for kind in [DocumentKind::Drone, DocumentKind::Service] {
                let count = dispatch.documents.count_documents(kind, Some(place.tenant));
                let count = count.await?;
                if count > 0 {
                    let detail = format!(
                        "provider '{}' has {count} {}s; delete those first",
                        place.id,
                        kind.name()
                    );
                    return Err(Refusal::new(Code::InUse, detail));
                }
            }
            dispatch.check_no_open_delivery(place.tenant, None).await
        })
    }
}

/// Checks that a provider does not lift what an operator has suspended.
fn check_lifted(place: Place<'_>) -> Result<(), Refusal> {
    if place.caller.role == Role::Provider && place.stood == SUSPENDED_BY_OPERATOR {
        let detail = format!(
            "an operator has suspended provider '{}', and lifts it",
            place.id
        );
        return Err(Refusal::new(Code::Forbidden, detail));
    }
    Ok(())
}
