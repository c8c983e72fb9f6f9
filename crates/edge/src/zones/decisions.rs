//! What waits for an operator: proposals from reports and feeds, and removals that are many at once.

use crate::writer::commands::{Command, Decision, Done, unexpected};
use crate::{Edge, views};
use skyway_contract as wire;
use skyway_service::access::Caller;
use skyway_service::intake::{PageRequest, filtered, token};
use skyway_service::refusal::Refusal;
use std::sync::Arc;

impl Edge {
    /// A page of proposals, oldest first.
    ///
    /// # Errors
    /// When the page is not one.
    pub fn proposals(
        &self,
        _caller: &Caller,
        page: &PageRequest,
    ) -> Result<wire::Proposals<'static>, Refusal> {
        let page = page.check()?;
        let snapshot = self.snapshot();
        let after = views::number_after(&page, "proposal", self.lineage)?;
        let (told, next) = filtered(&snapshot.proposals, after, page.size, |_| true);
        let proposals = told.iter().map(|entry| views::proposal(&snapshot, entry));
        Ok(wire::Proposals {
            proposals: proposals.collect(),
            next_page_token: next.map(|number| token(&views::proposal_id(self.lineage, number))),
            stamp: self.stamp_of(&snapshot),
        })
    }

    /// Puts a proposal into force, or drops it; gives the proposal.
    ///
    /// # Errors
    /// When there is none, or what it would put cannot be put any more.
    pub async fn decide_proposal(
        self: &Arc<Self>,
        caller: &Caller,
        id: &str,
        decision: Decision,
    ) -> Result<wire::Proposal<'static>, Refusal> {
        let number = views::number_in(id, "proposal", self.lineage);
        let number = number.ok_or_else(|| Refusal::not_found("proposal", id))?;
        let (outcome, snapshot) = self
            .command(Command::DecideProposal { number, decision }.by(caller))
            .await?;
        match outcome.done {
            Done::Proposal(entry) => Ok(views::proposal(&snapshot, &entry)),
            _ => Err(unexpected()),
        }
    }

    /// A page of holds, oldest first.
    ///
    /// # Errors
    /// When the page is not one.
    pub fn holds(
        &self,
        _caller: &Caller,
        page: &PageRequest,
    ) -> Result<wire::Holds<'static>, Refusal> {
        let page = page.check()?;
        let snapshot = self.snapshot();
        let after = views::number_after(&page, "hold", self.lineage)?;
        let (told, next) = filtered(&snapshot.holds, after, page.size, |_| true);
        Ok(wire::Holds {
            holds: told
                .iter()
                .map(|entry| views::hold(&snapshot, entry))
                .collect(),
            next_page_token: next.map(|number| token(&views::hold_id(self.lineage, number))),
            stamp: self.stamp_of(&snapshot),
        })
    }

    /// Lets held removals go, or drops them; gives the hold.
    ///
    /// # Errors
    /// When there is none.
    pub async fn decide_hold(
        self: &Arc<Self>,
        caller: &Caller,
        id: &str,
        decision: Decision,
    ) -> Result<wire::Hold<'static>, Refusal> {
        let number = views::number_in(id, "hold", self.lineage);
        let number = number.ok_or_else(|| Refusal::not_found("hold", id))?;
        let (outcome, snapshot) = self
            .command(Command::DecideHold { number, decision }.by(caller))
            .await?;
        match outcome.done {
            Done::Hold(entry) => Ok(views::hold(&snapshot, &entry)),
            _ => Err(unexpected()),
        }
    }
}
