//! Providers, their drones and services, and customers: documents that their tenants put.
//!
//! Listed, read, put and deleted in one way; what is special of each stands in a file of its own.

mod customers;
mod drones;
mod personal_data;
mod providers;
mod services;

use super::Dispatch;
use super::records::{Kept, absent, fresh, text};
use serde::Serialize;
use serde::de::DeserializeOwned;
use skyway_engine::network::Topology;
use skyway_registry::documents::{
    Commit, Committed, Document, DocumentKind, DocumentQuery, Unless,
};
use skyway_registry::store::StoreError;
use skyway_service::access::{Caller, Owners, Role, TENANT_BYTES_MAX, is_tenant};
use skyway_service::intake::{Expected, Faults, PageRequest, token};
use skyway_service::refusal::{Code, Refusal};
use std::pin::Pin;
use std::sync::Arc;

/// How often a write is decided anew because others got in between.
const DECISIONS: u32 = 16;
/// The longest name for people, in bytes.
const NAME_BYTES_MAX: usize = 200;
/// The longest contact, in bytes.
const CONTACT_BYTES_MAX: usize = 500;
/// The longest name of an airframe, in bytes.
const AIRFRAME_BYTES_MAX: usize = 64;
/// The heaviest payload, in kilograms; more is a slip of units.
const PAYLOAD_MAX_KG: f64 = 100.0;

/// What a check finds out with the help of the store.
type Checked<'a, T> = Pin<Box<dyn Future<Output = Result<T, Refusal>> + Send + 'a>>;

/// Something that tenants put.
pub trait Entry: Clone + Serialize + DeserializeOwned + Send + Sync + 'static {
    /// What it is in the store.
    const KIND: DocumentKind;
    /// Whether customers see those of every tenant.
    const IS_OFFERED: bool;
    /// The most of one tenant.
    const OF_TENANT_MAX: u64;
    /// The most of all tenants.
    const MAX: u64;

    /// The tenant whose it would be under an id.
    ///
    /// # Errors
    /// When the caller may put nothing there; by a fault where no caller could.
    fn tenant(&self, caller: &Caller, id: &str) -> Result<String, Refusal>;

    /// As it is kept under an id in place of what was there.
    ///
    /// # Errors
    /// Everything wrong with it.
    fn checked<'a>(
        self,
        dispatch: &'a Dispatch,
        place: Place<'a>,
        before: Option<&'a Self>,
    ) -> Checked<'a, Self>;

    /// How it stands, for those who look for all that stand so.
    fn state(&self, _place: Place<'_>) -> &'static str {
        ""
    }

    /// What a caller sees of it.
    fn shown(self, caller: &Caller, tenant: &str) -> Self;

    /// What comes to need it without changing it: where that is there by then, it is not deleted.
    fn unless(_place: Place<'_>) -> Option<Unless> {
        None
    }

    /// Checks that nothing needs it any more.
    ///
    /// # Errors
    /// When something does.
    fn check_unused<'a>(&'a self, dispatch: &'a Dispatch, place: Place<'a>) -> Checked<'a, ()>;
}

/// Under which id, whose, and who puts or deletes it.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a> {
    /// The id.
    pub id: &'a str,
    /// The tenant.
    pub tenant: &'a str,
    /// Who puts or deletes it.
    pub caller: &'a Caller,
    /// How what is there stands; empty where nothing is.
    pub stood: &'a str,
}

/// Something of the directory, and its version as an entity tag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tagged<T> {
    /// What it is.
    pub value: T,
    /// Its id.
    pub id: String,
    /// Its version.
    pub etag: String,
    /// Whether it is new.
    pub created: bool,
}

/// A page of something, by id.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Listed<T> {
    /// What is on it.
    pub entries: Vec<T>,
    /// Where the next page begins; none on the last.
    pub next_page_token: Option<String>,
}

impl Dispatch {
    /// What a caller sees of a kind, by id.
    ///
    /// # Errors
    /// When the page is none, or the store does not answer.
    pub async fn entries<T: Entry>(
        &self,
        caller: &Caller,
        page: &PageRequest,
    ) -> Result<Listed<T>, Refusal> {
        let is_own = caller.role.is_of_tenant() && !is_offered::<T>(caller);
        let tenant = is_own.then_some(&*caller.tenant);
        let (documents, next_page_token) = self.page_of(T::KIND, tenant, page).await?;
        let shown = documents.into_iter().map(|document| {
            let kept: Kept<T> = Kept::read(document)?;
            Ok(kept.value.shown(caller, &kept.document.tenant))
        });
        Ok(Listed {
            entries: shown.collect::<Result<_, Refusal>>()?,
            next_page_token,
        })
    }

    /// A page of what is kept of a kind, by id, of one tenant or of all; and where the next page begins.
    pub(crate) async fn page_of(
        &self,
        kind: DocumentKind,
        tenant: Option<&str>,
        page: &PageRequest,
    ) -> Result<(Vec<Document>, Option<String>), Refusal> {
        let page = page.check()?;
        let query = DocumentQuery {
            kind,
            of: tenant.map(str::to_owned),
            states: Vec::new(),
            after: page.after,
            limit: page.size as u64 + 1,
            is_newest_first: false,
        };
        let mut documents = self.documents.documents(&query).await?;
        let has_more = documents.len() > page.size;
        documents.truncate(page.size);
        let last = documents.last().filter(|_| has_more);
        let next_page_token = last.map(|last| token(&last.id));
        Ok((documents, next_page_token))
    }

    /// Something of a kind by its id.
    ///
    /// # Errors
    /// When there is none that the caller may see, or the store does not answer.
    pub async fn entry<T: Entry>(&self, caller: &Caller, id: &str) -> Result<Tagged<T>, Refusal> {
        let kept = self.seen_entry::<T>(caller, id).await?;
        Ok(tagged(kept, caller))
    }

    /// Puts something under an id, new or in place of the version that `If-Match` names.
    ///
    /// # Errors
    /// When it is not valid, the id is not the caller's, another version is there, there are too many, or the store does
    /// not answer.
    pub async fn put_entry<T: Entry>(
        &self,
        caller: &Caller,
        id: &str,
        draft: &T,
        if_match: Option<String>,
    ) -> Result<Tagged<T>, Refusal> {
        let tenant = draft.tenant(caller, id)?;
        let expected = Expected::of(if_match);
        for _ in 0..DECISIONS {
            let before = self.documents.document(T::KIND, id).await?;
            let before: Option<Kept<T>> = before.map(Kept::read).transpose()?;
            if before
                .as_ref()
                .is_some_and(|before| before.document.tenant != tenant)
            {
                return Err(Refusal::not_found(T::KIND.name(), id));
            }
            let tag = before.as_ref().map(|before| etag(&before.document));
            expected.check(tag.as_deref(), T::KIND.name(), id)?;
            if before.is_none() {
                self.check_number::<T>(&tenant).await?;
            }
            let stood = before.as_ref().map(|before| &*before.document.state);
            let place = Place {
                id,
                tenant: &tenant,
                caller,
                stood: stood.unwrap_or_default(),
            };
            let value = draft.clone();
            let value = value
                .checked(self, place, before.as_ref().map(|before| &before.value))
                .await?;
            let after = self.next_document(&value, place, before.as_ref());
            let commit = Commit {
                seen: vec![match &before {
                    Some(before) => before.seen(),
                    None => absent(T::KIND, id),
                }],
                puts: vec![after.clone()],
                ..Commit::default()
            };
            if self.documents.commit(&commit).await? != Committed::Moved {
                let document = after;
                return Ok(tagged(Kept { document, value }, caller));
            }
        }
        Err(StoreError::Contended.into())
    }

    /// Deletes the version of something that `If-Match` names.
    ///
    /// # Errors
    /// When there is none that is the caller's, it has another version, something needs it, or the store does not answer.
    pub async fn delete_entry<T: Entry>(
        &self,
        caller: &Caller,
        id: &str,
        if_match: Option<String>,
    ) -> Result<(), Refusal> {
        let expected = Expected::of(if_match);
        for _ in 0..DECISIONS {
            let before = self.seen_entry::<T>(caller, id).await?;
            let tag = etag(&before.document);
            expected.check(Some(&tag), T::KIND.name(), id)?;
            let place = Place {
                id,
                tenant: &before.document.tenant,
                caller,
                stood: &before.document.state,
            };
            before.value.check_unused(self, place).await?;
            let commit = Commit {
                seen: vec![before.seen()],
                unless: T::unless(place),
                deletes: vec![(T::KIND, id.to_owned())],
                ..Commit::default()
            };
            if self.documents.commit(&commit).await? != Committed::Moved {
                return Ok(());
            }
        }
        Err(StoreError::Contended.into())
    }

    async fn seen_entry<T: Entry>(&self, caller: &Caller, id: &str) -> Result<Kept<T>, Refusal> {
        let document = self.documents.document(T::KIND, id).await?;
        let document = document.filter(|document| {
            let owners = Owners {
                tenant: &document.tenant,
                party: &document.party,
            };
            is_offered::<T>(caller) || caller.sees(&owners)
        });
        Kept::read(document.ok_or_else(|| Refusal::not_found(T::KIND.name(), id))?)
    }

    async fn check_number<T: Entry>(&self, tenant: &str) -> Result<(), Refusal> {
        let kind = T::KIND;
        let of_tenant = self.documents.count_documents(kind, Some(tenant)).await?;
        if of_tenant >= T::OF_TENANT_MAX {
            let detail = format!("'{tenant}' has {of_tenant} {}s already", kind.name());
            return Err(Refusal::new(Code::LimitReached, detail));
        }
        let all = self.documents.count_documents(kind, None).await?;
        if all >= T::MAX {
            let detail = format!("there are {all} {}s already", kind.name());
            return Err(Refusal::new(Code::LimitReached, detail));
        }
        Ok(())
    }

    /// The network of a name; a fault where there is none.
    async fn network_of(
        &self,
        network: &str,
        faults: &mut Faults,
    ) -> Result<Option<Arc<Topology>>, Refusal> {
        match self.registry.topology(network).await {
            Ok(topology) => Ok(Some(topology)),
            Err(refusal) if refusal.code == Code::NotFound => {
                let hint = "GET /v1/networks lists them".to_owned();
                faults.add("unknown_network", "/network", refusal.detail, Some(hint));
                Ok(None)
            }
            Err(refusal) => Err(refusal),
        }
    }

    fn next_document<T: Entry>(
        &self,
        value: &T,
        place: Place<'_>,
        before: Option<&Kept<T>>,
    ) -> Document {
        let owners = (place.tenant, "");
        let stands = (value.state(place), text(value));
        let made = fresh(T::KIND, place.id, owners, stands, self.clock.now());
        Document {
            version: before.map_or(1, |before| before.document.version + 1),
            ..made
        }
    }
}

/// Whether a caller sees those of every tenant.
fn is_offered<T: Entry>(caller: &Caller) -> bool {
    T::IS_OFFERED && caller.role == Role::Customer
}

fn tagged<T: Entry>(kept: Kept<T>, caller: &Caller) -> Tagged<T> {
    let Kept { document, value } = kept;
    Tagged {
        value: value.shown(caller, &document.tenant),
        etag: etag(&document),
        created: document.version == 1,
        id: document.id,
    }
}

/// Its version, and when it was made so: one that is put again after it was deleted begins with the first version.
pub(super) fn etag(document: &Document) -> String {
    format!("\"{}-{}\"", document.version, document.changed_ms)
}

/// The tenant of an id that is one: the caller's own, or any for who acts for all.
fn tenant_named(caller: &Caller, kind: DocumentKind, id: &str) -> Result<String, Refusal> {
    if !is_tenant(id) {
        let message = format!(
            "the id '{id}' is not 1 to {TENANT_BYTES_MAX} letters, digits, '-', '_' and '.'"
        );
        return Err(unfit_id(message, None));
    }
    let own = caller.acts_for(Some(id));
    own.map(str::to_owned)
        .ok_or_else(|| Refusal::not_found(kind.name(), id))
}

/// The tenant before the colon of an id `TENANT:NAME`: the caller's own, or any for who acts for all.
pub(super) fn tenant_before_colon(
    caller: &Caller,
    kind: DocumentKind,
    id: &str,
) -> Result<String, Refusal> {
    let mut faults = Faults::default();
    faults.id("{id}", Some(id));
    faults.check(Code::ParameterInvalid, "id")?;
    let named = id.split_once(':');
    let Some((tenant, _)) = named.filter(|(tenant, name)| is_tenant(tenant) && !name.is_empty())
    else {
        let own = caller.acts_for(None).unwrap_or_default();
        let message = format!("the id '{id}' does not begin with its tenant and a colon");
        let hint = format!("write '{own}:{}'", id.replace(':', "-"));
        return Err(unfit_id(message, Some(hint)));
    };
    let own = caller.acts_for(Some(tenant));
    own.map(str::to_owned)
        .ok_or_else(|| Refusal::not_found(kind.name(), id))
}

fn unfit_id(message: String, hint: Option<String>) -> Refusal {
    let mut faults = Faults::default();
    faults.add("id_invalid", "{id}", message, hint);
    faults.refusal(Code::ParameterInvalid, "id")
}

/// Checks that a body, where it repeats something of its path, repeats it rightly.
fn check_repeated(faults: &mut Faults, pointer: &str, stated: Option<&str>, is: &str) {
    if let Some(stated) = stated.filter(|stated| *stated != is) {
        let message = format!("'{stated}' is not '{is}', as the path says");
        faults.add(
            "id_mismatch",
            pointer,
            message,
            Some("leave it out".to_owned()),
        );
    }
}

/// Checks a name for people.
fn check_name(faults: &mut Faults, name: &str) {
    faults.text("/name", Some(name), NAME_BYTES_MAX);
    if name.trim().is_empty() {
        faults.add("text_empty", "/name", "the name is empty".to_owned(), None);
    }
}

/// Checks the heaviest payload.
fn check_payload(faults: &mut Faults, payload_max_kg: f64) {
    let number = faults.number("/payload_max_kg", Some(payload_max_kg), 0.0, PAYLOAD_MAX_KG);
    if number == Some(0.0) {
        let message = "nothing can be carried".to_owned();
        faults.add("out_of_range", "/payload_max_kg", message, None);
    }
}
