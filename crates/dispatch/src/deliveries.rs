//! Orders looked at, and the proof that providers add.

use super::Dispatch;
use super::orders::DECISIONS;
use super::records::{Kept, Order};
use super::views::{Eyes, view};
use skyway_contract::{Deliveries, Delivery, DeliveryStatus, ProofOfDelivery, Recipient};
use skyway_registry::documents::{Commit, Committed, DocumentKind};
use skyway_registry::store::StoreError;
use skyway_service::access::{Caller, Owners, Role};
use skyway_service::intake::{Faults, PageRequest};
use skyway_service::refusal::{Code, Refusal};

const WHAT: &str = "delivery";
/// The longest reference to a photo, in bytes.
const PHOTO_BYTES_MAX: usize = 500;
/// The longest code of a recipient, in bytes.
const CODE_BYTES_MAX: usize = 64;

impl Dispatch {
    /// A page of the deliveries that a caller sees, by id: the oldest first.
    ///
    /// # Errors
    /// When the page is none, or the store does not answer.
    pub async fn deliveries(
        &self,
        caller: &Caller,
        page: &PageRequest,
    ) -> Result<Deliveries, Refusal> {
        let is_own = caller.role.is_of_tenant();
        let (kind, tenant) = (DocumentKind::Delivery, is_own.then_some(&*caller.tenant));
        let (documents, next_page_token) = self.page_of(kind, tenant, page).await?;
        let views = documents.into_iter().map(|document| {
            let order: Kept<Order> = Kept::read(document)?;
            let eyes = Eyes::of(caller, &order.value.delivery);
            Ok(view(&order.value, eyes, None))
        });
        Ok(Deliveries {
            deliveries: views.collect::<Result<_, Refusal>>()?,
            next_page_token,
        })
    }

    /// A delivery; to its customer with the recipient.
    ///
    /// # Errors
    /// When there is none that the caller may see, or the store does not answer.
    pub async fn delivery(&self, caller: &Caller, id: &str) -> Result<Delivery, Refusal> {
        let order = self.seen_order(caller, id).await?;
        self.told(caller, &order).await
    }

    /// A delivery as a caller is told it.
    pub(super) async fn told(
        &self,
        caller: &Caller,
        order: &Kept<Order>,
    ) -> Result<Delivery, Refusal> {
        let eyes = Eyes::of(caller, &order.value.delivery);
        let recipient = match eyes {
            Eyes::Customer => self.recipient(&order.document.id).await?,
            Eyes::Provider | Eyes::Operator => None,
        };
        Ok(view(&order.value, eyes, recipient))
    }

    async fn recipient(&self, id: &str) -> Result<Option<Recipient>, Refusal> {
        let kind = DocumentKind::Recipient;
        let document = self.documents.document(kind, id).await?;
        let kept: Option<Kept<Recipient>> = document.map(Kept::read).transpose()?;
        Ok(kept.map(|kept| kept.value))
    }

    /// An order, for any caller.
    ///
    /// # Errors
    /// When there is none, or the store does not answer.
    pub(super) async fn order(&self, id: &str) -> Result<Kept<Order>, Refusal> {
        let document = self.documents.document(DocumentKind::Delivery, id).await?;
        Kept::read(document.ok_or_else(|| Refusal::not_found(WHAT, id))?)
    }

    /// An order that a caller may see; to others it is not there.
    pub(super) async fn seen_order(
        &self,
        caller: &Caller,
        id: &str,
    ) -> Result<Kept<Order>, Refusal> {
        let order = self.order(id).await?;
        let owners = Owners {
            tenant: &order.document.tenant,
            party: &order.document.party,
        };
        match caller.sees(&owners) {
            true => Ok(order),
            false => Err(Refusal::not_found(WHAT, id)),
        }
    }

    /// Adds what its provider has of a delivery's proof: a photo, a code, the place. When it arrived, the flight has told. Once
    /// the customer's data were deleted, only the place is kept.
    ///
    /// # Errors
    /// When there is no such delivery of the provider's, it has not arrived, or the store does not answer.
    pub async fn prove_delivery(
        &self,
        caller: &Caller,
        id: &str,
        proof: &ProofOfDelivery,
    ) -> Result<Delivery, Refusal> {
        check_proof(proof)?;
        for _ in 0..DECISIONS {
            let mut order = self.seen_order(caller, id).await?;
            let is_its_provider = *caller.tenant == *order.document.party;
            if caller.role.is_of_tenant() && !is_its_provider {
                return Err(Refusal::not_found(WHAT, id));
            }
            let delivery = &mut order.value.delivery;
            let status = delivery.status;
            let arrived = (status == DeliveryStatus::Delivered)
                .then_some(&mut delivery.proof)
                .and_then(Option::as_mut);
            let Some(arrived) = arrived else {
                let detail = format!("the delivery is {}, not delivered", status.name());
                return Err(Refusal::new(Code::DeliveryStateConflict, detail));
            };
            complete(arrived, proof);
            if order.value.dispatch.is_stripped {
                (arrived.photo, arrived.code) = (None, None);
            }
            let commit = Commit {
                seen: vec![order.seen()],
                puts: vec![order.next(self.clock.now())],
                ..Commit::default()
            };
            if self.documents.commit(&commit).await? == Committed::Done {
                return self.told(caller, &order).await;
            }
        }
        Err(StoreError::Contended.into())
    }
}

fn check_proof(proof: &ProofOfDelivery) -> Result<(), Refusal> {
    let mut faults = Faults::default();
    faults.instant("/at", Some(&proof.at));
    faults.number("/lon", proof.lon, -180.0, 180.0);
    faults.number("/lat", proof.lat, -90.0, 90.0);
    let missing = match (proof.lon, proof.lat) {
        (Some(_), None) => Some("/lat"),
        (None, Some(_)) => Some("/lon"),
        _ => None,
    };
    if let Some(pointer) = missing {
        let message = "a place has both longitude and latitude".to_owned();
        faults.add("missing_field", pointer, message, None);
    }
    faults.text("/photo", proof.photo.as_deref(), PHOTO_BYTES_MAX);
    faults.text("/code", proof.code.as_deref(), CODE_BYTES_MAX);
    faults.check(Code::BodyInvalid, "proof")
}

/// Adds to a proof what it lacks. What the flight has told stays.
fn complete(arrived: &mut ProofOfDelivery, added: &ProofOfDelivery) {
    if arrived.lon.is_none() && arrived.lat.is_none() {
        (arrived.lon, arrived.lat) = (added.lon, added.lat);
    }
    arrived.photo = added.photo.clone().or(arrived.photo.take());
    arrived.code = added.code.clone().or(arrived.code.take());
}

/// Whether a caller may call a delivery off: its customer, and who may everything.
pub(super) fn may_call_off(caller: &Caller, order: &Order) -> bool {
    match caller.role {
        Role::Operator | Role::Anyone => true,
        Role::Customer | Role::Provider => *caller.tenant == *order.delivery.customer,
        Role::Drone | Role::Edge | Role::Metrics => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_of_a_proof_has_both_of_its_numbers() {
        let places = [
            (None, None, None),
            (Some(151.0), Some(-33.0), None),
            (Some(151.0), None, Some("/lat")),
            (None, Some(-33.0), Some("/lon")),
        ];
        for (lon, lat, missing) in places {
            let proof = ProofOfDelivery {
                at: "2026-11-27T18:00:00Z".to_owned(),
                lon,
                lat,
                photo: None,
                code: None,
            };
            let refused = check_proof(&proof).err();
            let pointers = refused.map(|refusal| refusal.faults[0].pointer.clone());
            assert_eq!(pointers.as_deref(), missing, "{lon:?} {lat:?}");
        }
    }
}
