//! Customers: who orders.

use super::{CONTACT_BYTES_MAX, Checked, Entry, Place, check_name, check_repeated, tenant_named};
use crate::Dispatch;
use skyway_contract::Customer;
use skyway_registry::documents::DocumentKind;
use skyway_service::access::{Caller, Role};
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};

impl Entry for Customer {
    const KIND: DocumentKind = DocumentKind::Customer;
    const IS_OFFERED: bool = false;
    const OF_TENANT_MAX: u64 = 1;
    const MAX: u64 = 1_000_000;

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
        let checked = faults.check(Code::BodyInvalid, Self::KIND.name());
        Box::pin(async move { checked.map(|()| self) })
    }

    fn shown(mut self, caller: &Caller, tenant: &str) -> Self {
        let is_own = caller.role.is_of_tenant() && *caller.tenant == *tenant;
        if !is_own && caller.role != Role::Anyone {
            self.contact = None;
        }
        self
    }

    fn check_unused<'a>(&'a self, dispatch: &'a Dispatch, place: Place<'a>) -> Checked<'a, ()> {
        Box::pin(dispatch.check_no_open_order(place.tenant))
    }
}
