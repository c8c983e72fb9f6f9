//! All that is kept of a customer: told to it, and deleted when it wants that.
//!
//! Deleted are the customer, its quotes and webhooks, the recipients of its parcels, and what was answered to its orders; of its
//! deliveries what could name a person.
//! The deliveries themselves stay, as its providers' accounts need them.

use super::{DECISIONS, etag};
use crate::Dispatch;
use crate::records::{Kept, RESERVING, open_states, seen, text};
use serde::Deserialize;
use serde_json::{Value, json};
use skyway_contract::{Customer, CustomerData, Delivery, Quote, Recipient};
use skyway_registry::documents::{
    Commit, Committed, Document, DocumentKind, DocumentQuery, Unless,
};
use skyway_registry::store::StoreError;
use skyway_service::access::{Caller, Role, is_tenant};
use skyway_service::intake::{Expected, PageRequest};
use skyway_service::refusal::{Code, Refusal};
use std::collections::BTreeMap;
use std::sync::Arc;

/// How many deliveries are told, and how many quotes.
const TOLD_MAX: usize = 1_000;
/// How many documents are read, or changed by one commit.
const AT_ONCE: u64 = 200;
/// What of a delivery may name a person.
const PERSONAL: [&str; 2] = ["reference", "recipient"];
/// What of its proof may.
const PERSONAL_PROOF: [&str; 2] = ["photo", "code"];
/// What tells of an order that its proof is kept without them.
const STRIPPED: &str = "is_stripped";

/// What of a delivery tells its service.
#[derive(Deserialize)]
struct OfService {
    #[serde(default)]
    service_id: Option<String>,
}

impl Dispatch {
    /// All that is kept of a customer.
    ///
    /// # Errors
    /// When it is not the caller's own, or the store does not answer.
    pub async fn customer_data(&self, caller: &Caller, id: &str) -> Result<CustomerData, Refusal> {
        own(caller, id)?;
        let customer = self.documents.document(DocumentKind::Customer, id).await?;
        let customer: Option<Kept<Customer>> = customer.map(Kept::read).transpose()?;
        let mut recipients: BTreeMap<String, Recipient> = BTreeMap::new();
        let (mut deliveries, mut is_cut_off) = (Vec::new(), false);
        let mut pages = Pages::of(DocumentKind::Delivery, id);
        'pages: while let Some(page) = pages.next(self).await? {
            for document in page.into_iter().filter(|delivery| delivery.tenant == id) {
                if deliveries.len() == TOLD_MAX {
                    is_cut_off = true;
                    break 'pages;
                }
                let is_reserving = document.state == RESERVING;
                let mut delivery = Kept::<Delivery>::read(document)?.value;
                if is_reserving {
                    // Its edge may yet refuse.
                    delivery.allocation = None;
                }
                deliveries.push(delivery);
            }
        }
        let mut pages = Pages::of(DocumentKind::Recipient, id);
        while let Some(page) = pages.next(self).await? {
            for document in page {
                let kept: Kept<Recipient> = Kept::read(document)?;
                recipients.insert(kept.document.id, kept.value);
            }
        }
        for delivery in &mut deliveries {
            delivery.recipient = recipients.remove(&delivery.id);
        }
        let as_customer = Caller {
            role: Role::Customer,
            subject: caller.subject.clone(),
            tenant: Arc::from(id),
            network: None,
        };
        let all = PageRequest {
            size: Some(1_000),
            token: None,
        };
        let (quotes, are_cut_off) = self.quotes_of(id).await?;
        is_cut_off |= are_cut_off;
        Ok(CustomerData {
            customer: customer.map(|customer| customer.value),
            deliveries,
            quotes,
            webhooks: self.webhooks(&as_customer, &all).await?.webhooks,
            is_cut_off,
        })
    }

    /// The first `TOLD_MAX` quotes of a customer, and whether there are more.
    async fn quotes_of(&self, customer: &str) -> Result<(Vec<Quote>, bool), Refusal> {
        let mut quotes = Vec::new();
        let mut pages = Pages::of(DocumentKind::Quote, customer);
        while let Some(page) = pages.next(self).await? {
            for document in page.into_iter().filter(|quote| quote.tenant == customer) {
                if quotes.len() == TOLD_MAX {
                    return Ok((quotes, true));
                }
                quotes.push(Kept::<Quote>::read(document)?.value);
            }
        }
        Ok((quotes, false))
    }

    /// Deletes what is kept of a customer, in the version of it that `If-Match` names.
    ///
    /// # Errors
    /// When it is not the caller's own, it has another version, one of its deliveries is not over, or the store does not
    /// answer.
    pub async fn delete_customer_data(
        &self,
        caller: &Caller,
        id: &str,
        if_match: Option<String>,
    ) -> Result<(), Refusal> {
        own(caller, id)?;
        // What was ordered may have to be deleted where nothing else is kept.
        let expected = if_match.map_or(Expected::Anything, Expected::Tags);
        self.expected_customer(id, &expected).await?;
        self.check_no_open_order(id).await?;
        self.strip_deliveries(id).await?;
        let kinds = [
            DocumentKind::Quote,
            DocumentKind::Recipient,
            DocumentKind::Webhook,
        ];
        for kind in kinds {
            let mut pages = Pages::of(kind, id);
            while let Some(page) = pages.next(self).await? {
                // That takes a while: who has ordered meanwhile keeps its recipient. One that is on the page was put with its
                // order, which is found from then on.
                self.check_no_open_order(id).await?;
                // Its party, a provider, may have the same id.
                let deletes = page.into_iter().filter(|document| document.tenant == id);
                let deletes = deletes.map(|document| (document.kind, document.id));
                let commit = Commit {
                    deletes: deletes.collect(),
                    ..Commit::default()
                };
                self.documents.commit(&commit).await?;
            }
        }
        self.delete_customer(id, &expected).await
    }

    /// A customer in the version that is expected; none where none may be there.
    async fn expected_customer(
        &self,
        id: &str,
        expected: &Expected,
    ) -> Result<Option<Document>, Refusal> {
        let kind = DocumentKind::Customer;
        let customer = self.documents.document(kind, id).await?;
        let tag = customer.as_ref().map(etag);
        expected.check(tag.as_deref(), kind.name(), id)?;
        Ok(customer)
    }

    async fn delete_customer(&self, id: &str, expected: &Expected) -> Result<(), Refusal> {
        for _ in 0..DECISIONS {
            let Some(customer) = self.expected_customer(id, expected).await? else {
                return Ok(());
            };
            let commit = Commit {
                seen: vec![seen(&customer)],
                deletes: vec![(customer.kind, customer.id)],
                ..Commit::default()
            };
            if self.documents.commit(&commit).await? != Committed::Moved {
                return Ok(());
            }
        }
        Err(StoreError::Contended.into())
    }

    async fn strip_deliveries(&self, customer: &str) -> Result<(), Refusal> {
        let mut pages = Pages::of(DocumentKind::Delivery, customer);
        while let Some(page) = pages.next(self).await? {
            let mut commit = Commit::default();
            for document in page
                .into_iter()
                .filter(|delivery| delivery.tenant == customer)
            {
                commit.untold.push(document.id.clone());
                self.strip(document).await?;
            }
            // What was answered to an order has its reference, too.
            self.documents.commit(&commit).await?;
        }
        Ok(())
    }

    async fn strip(&self, mut document: Document) -> Result<(), Refusal> {
        for _ in 0..DECISIONS {
            if open_states().any(|state| state == document.state) {
                return Err(in_use(&document.id));
            }
            let Some(body) = without_personal(&document)? else {
                return Ok(());
            };
            let after = Document {
                version: document.version + 1,
                changed_ms: self.clock.now().as_millisecond(),
                body,
                ..document.clone()
            };
            let commit = Commit {
                seen: vec![seen(&document)],
                puts: vec![after],
                ..Commit::default()
            };
            if self.documents.commit(&commit).await? != Committed::Moved {
                return Ok(());
            }
            let found = self.documents.document(document.kind, &document.id).await?;
            let Some(found) = found else {
                return Ok(());
            };
            document = found;
        }
        Err(StoreError::Contended.into())
    }

    /// Checks that a customer has no delivery that is not over.
    pub(super) async fn check_no_open_order(&self, customer: &str) -> Result<(), Refusal> {
        let mut pages = Pages::open(customer);
        while let Some(page) = pages.next(self).await? {
            if let Some(open) = page.iter().find(|document| document.tenant == customer) {
                return Err(in_use(&open.id));
            }
        }
        Ok(())
    }

    /// Checks that a provider, or one of its services, has no delivery that is not over.
    pub(super) async fn check_no_open_delivery(
        &self,
        provider: &str,
        service: Option<&str>,
    ) -> Result<(), Refusal> {
        let mut pages = Pages::open(provider);
        while let Some(page) = pages.next(self).await? {
            for document in page {
                let kept: Kept<OfService> = Kept::read(document)?;
                let is_of = service.is_none_or(|id| kept.value.service_id.as_deref() == Some(id));
                if kept.document.party == provider && is_of {
                    return Err(in_use(&kept.document.id));
                }
            }
        }
        Ok(())
    }
}

/// A caller asks for itself; for who acts for all, any tenant is one.
fn own(caller: &Caller, id: &str) -> Result<(), Refusal> {
    if is_tenant(id) && caller.acts_for(Some(id)).is_some() {
        return Ok(());
    }
    Err(Refusal::not_found(DocumentKind::Customer.name(), id))
}

fn in_use(delivery: &str) -> Refusal {
    let detail = format!("the delivery '{delivery}' is not over; call it off, or wait for its end");
    Refusal::new(Code::InUse, detail)
}

/// A delivery of a provider's service that is not over.
pub(super) fn open_delivery(provider: &str, service: &str) -> Unless {
    Unless {
        query: open_deliveries(provider),
        member: ("service_id", service.to_owned()),
    }
}

/// The body of a delivery without what may name a person; none where it has nothing of it.
fn without_personal(document: &Document) -> Result<Option<String>, Refusal> {
    let mut body = Kept::<Value>::read(document.clone())?.value;
    let mut is_changed = false;
    if let Some(delivery) = body.as_object_mut() {
        for name in PERSONAL {
            is_changed |= delivery.remove(name).is_some();
        }
    }
    if let Some(proof) = body.get_mut("proof").and_then(Value::as_object_mut) {
        for name in PERSONAL_PROOF {
            is_changed |= proof.remove(name).is_some();
        }
        // Its provider may add them later.
        is_changed |= body["dispatch"][STRIPPED] != true;
        body["dispatch"][STRIPPED] = json!(true);
    }
    Ok(is_changed.then(|| text(&body)))
}

/// What a tenant has of a kind, or is party to.
fn all_of(kind: DocumentKind, tenant: &str) -> DocumentQuery {
    DocumentQuery {
        kind,
        of: Some(tenant.to_owned()),
        states: Vec::new(),
        after: None,
        limit: AT_ONCE,
        is_newest_first: false,
    }
}

fn open_deliveries(tenant: &str) -> DocumentQuery {
    DocumentQuery {
        states: open_states().map(str::to_owned).collect(),
        ..all_of(DocumentKind::Delivery, tenant)
    }
}

/// The documents of a tenant, page by page.
struct Pages {
    query: Option<DocumentQuery>,
}

impl Pages {
    fn of(kind: DocumentKind, tenant: &str) -> Self {
        Self {
            query: Some(all_of(kind, tenant)),
        }
    }

    /// Deliveries that are not over, of which the tenant is customer or provider.
    fn open(tenant: &str) -> Self {
        Self {
            query: Some(open_deliveries(tenant)),
        }
    }

    /// The next page; none after the last. Deliveries are on it too that a tenant is only party to.
    async fn next(&mut self, dispatch: &Dispatch) -> Result<Option<Vec<Document>>, Refusal> {
        let Some(query) = &mut self.query else {
            return Ok(None);
        };
        let page = dispatch.documents.documents(query).await?;
        let is_last = (page.len() as u64) < query.limit;
        query.after = page.last().map(|last| last.id.clone());
        if is_last {
            self.query = None;
        }
        Ok((!page.is_empty()).then_some(page))
    }
}
