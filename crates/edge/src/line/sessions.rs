//! Sessions: which drone is on whose line. A drone is on one session at a time; another one takes it over only where it
//! names the session that it ends, or where nothing was heard on that one for long.

use super::claims::{Claim, SessionLine};
use super::mailbox::message_number;
use super::stream::MailStream;
use crate::drones::DRONE_ID_BYTES_MAX;
use crate::writer::commands::Command;
use crate::{Edge, words};
use jiff::SignedDuration;
use skyway_contract as wire;
use skyway_service::access::Caller;
use skyway_service::refusal::{Code, Refusal};
use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

/// A drone is taken over at most this often.
const TAKEOVER_EVERY: SignedDuration = SignedDuration::from_secs(5);

/// A session of one drone or of many. Its drones leave the line when it is dropped; their mail is kept.
#[derive(Debug)]
pub struct Session {
    edge: Arc<Edge>,
    caller: Caller,
    line: Arc<SessionLine>,
}

/// What a hello comes to for one drone.
enum Claimed {
    Fresh,
    TakenOver(wire::EndedSession<'static>),
}

impl Edge {
    /// Begins a session without drones.
    pub fn begin_session(self: &Arc<Self>, caller: &Caller) -> Session {
        let number = self.claims.sessions.fetch_add(1, Ordering::Relaxed) + 1;
        let line = SessionLine {
            id: Arc::from(format!("session-{}-{number}", self.epoch)),
            line: Arc::default(),
            heard_at_us: AtomicI64::new(self.clock.now().as_microsecond()),
        };
        Session {
            edge: self.clone(),
            caller: caller.clone(),
            line: Arc::new(line),
        }
    }

    /// The mail of one drone, from after a message on; any number may listen to it beside its session.
    ///
    /// # Errors
    /// When the caller may not speak for it, or the id is not that of a message.
    pub fn mail(
        self: &Arc<Self>,
        caller: &Caller,
        drone: &str,
        after: Option<&str>,
    ) -> Result<MailStream, Refusal> {
        check_drone(caller, drone)?;
        let after = after
            .map(|id| message_number(id, self.lineage))
            .transpose()?;
        let received = after.unwrap_or(0);
        Ok(MailStream::of_drone(self, &Arc::from(drone), received))
    }

    /// A drone has received its messages up to one.
    ///
    /// # Errors
    /// When the caller may not speak for it, the id is not that of a message, or it cannot be noted.
    pub async fn receive_mail(
        self: &Arc<Self>,
        caller: &Caller,
        drone: &str,
        received: &wire::Received,
    ) -> Result<wire::MailLeft<'static>, Refusal> {
        check_drone(caller, drone)?;
        let through = message_number(&received.through, self.lineage)?;
        let drone: Arc<str> = Arc::from(drone);
        let command = Command::ReceiveMail {
            drone: drone.clone(),
            through,
        };
        let (_, snapshot) = self.command(command).await?;
        let left = snapshot.mail_of(&drone, 0).count();
        Ok(wire::MailLeft {
            drone_id: words::text(&drone),
            left: u32::try_from(left).unwrap_or(u32::MAX),
            stamp: self.stamp_of(&snapshot),
        })
    }
}

fn check_drone(caller: &Caller, drone: &str) -> Result<(), Refusal> {
    if drone.is_empty() || drone.len() > DRONE_ID_BYTES_MAX {
        let detail = format!("the id of a drone has 1 to {DRONE_ID_BYTES_MAX} bytes");
        return Err(Refusal::new(Code::ParameterInvalid, detail));
    }
    match caller.speaks_for(drone) {
        true => Ok(()),
        false => {
            let detail = format!("'{}' may not speak for drone '{drone}'", caller.subject);
            Err(Refusal::new(Code::Forbidden, detail))
        }
    }
}

impl Session {
    /// Something was said on it.
    pub fn heard(&self) {
        let now = self.edge.clock.now().as_microsecond();
        self.line.heard_at_us.store(now, Ordering::Relaxed);
    }

    /// How many drones are on it.
    pub fn drone_count(&self) -> usize {
        self.line.line.len()
    }

    /// What its drones are told, as it comes.
    pub fn mail(&self) -> MailStream {
        MailStream::of_session(&self.edge, &self.line.line)
    }

    /// Drones come on the line. One that may not does not keep the others from it.
    ///
    /// # Errors
    /// When there are more than a batch may have.
    pub fn hello(&self, drones: Vec<wire::HelloDrone>) -> Result<wire::Welcome<'static>, Refusal> {
        self.edge.check_batch("drones", drones.len())?;
        let mut welcome = wire::Welcome {
            session_id: words::text(&self.line.id),
            drones: Vec::new(),
            refused: Vec::new(),
            ended: Vec::new(),
            stamp: self.edge.stamp(),
        };
        for drone in drones {
            match self.admit(&drone) {
                Ok(claimed) => {
                    if let Claimed::TakenOver(ended) = claimed {
                        welcome.ended.push(ended);
                    }
                    welcome.drones.push(Cow::Owned(drone.drone_id));
                }
                Err((code, message)) => welcome.refused.push(wire::RefusedDrone {
                    drone_id: Cow::Owned(drone.drone_id),
                    reason: words::warning(code, &message),
                }),
            }
        }
        Ok(welcome)
    }

    /// Drones leave the line.
    pub fn goodbye(&self, drones: &[String]) {
        let mut claims = self.edge.claims.lock();
        for drone in drones {
            if claims.get(&**drone).is_some_and(|claim| self.holds(claim)) {
                claims.remove(&**drone);
                self.edge.lines.leave(&self.line.line, drone);
            }
        }
    }

    fn holds(&self, claim: &Claim) -> bool {
        Arc::ptr_eq(&claim.session, &self.line)
    }

    /// Puts a drone on the line, or says why not.
    fn admit(&self, hello: &wire::HelloDrone) -> Result<Claimed, (&'static str, String)> {
        let id = &hello.drone_id;
        check_drone(&self.caller, id).map_err(|refusal| ("drone_not_yours", refusal.detail))?;
        // An id that cannot be read says nothing: all that there is is told.
        let through = hello.received_through.as_deref();
        let through = through.map(|id| message_number(id, self.edge.lineage));
        let through = through.and_then(Result::ok).unwrap_or(0);
        let drone: Arc<str> = Arc::from(id.as_str());
        let claimed = self.claim(&drone, hello.ends_session.as_deref())?;
        if through > 0 {
            let command = Command::ReceiveMail {
                drone: drone.clone(),
                through,
            };
            if let Err(refusal) = self.edge.writer.tell(command) {
                // It is told once more, and received once more.
                tracing::warn!(%refusal, %drone, "what a drone has received could not be noted");
            }
        }
        self.edge.lines.join(&self.line.line, &drone, through);
        Ok(claimed)
    }

    fn claim(
        &self,
        drone: &Arc<str>,
        ends: Option<&str>,
    ) -> Result<Claimed, (&'static str, String)> {
        let now = self.edge.clock.now();
        let mut claims = self.edge.claims.lock();
        let held = claims.get(drone).cloned();
        let held = held.filter(|claim| !self.holds(claim));
        let Some(held) = held else {
            let most = self.edge.settings.drones_max;
            let flies = || self.edge.snapshot().plan_of_drone(drone).is_some();
            if claims.len() >= most && !claims.contains_key(drone) && !flies() {
                let message = format!("{most} drones are on sessions, as many as may be");
                return Err(("too_many_drones", message));
            }
            let claim = Claim {
                session: self.line.clone(),
                taken_over_at: None,
            };
            claims.entry(drone.clone()).or_insert(claim);
            return Ok(Claimed::Fresh);
        };
        let heard_at = held.session.heard_at_us.load(Ordering::Relaxed);
        // What was heard ahead of the clock was heard before it was set back.
        let silent = SignedDuration::from_micros(now.as_microsecond() - heard_at).abs();
        if ends != Some(&*held.session.id) && silent < self.edge.settings.silent_after {
            let message = format!(
                "drone '{drone}' is on another session: name it as ends_session to end that, or wait until nothing \
                 was heard on it for {} s",
                self.edge.settings.silent_after.as_secs()
            );
            return Err(("drone_on_another_session", message));
        }
        let taken_over_at = held.taken_over_at.filter(|at| *at <= now);
        let again_at = taken_over_at.map(|at| at + TAKEOVER_EVERY);
        if again_at.is_some_and(|again_at| now < again_at) {
            let message = format!(
                "drone '{drone}' was taken over less than {} s ago; try again then",
                TAKEOVER_EVERY.as_secs()
            );
            return Err(("taken_over_too_often", message));
        }
        let claim = Claim {
            session: self.line.clone(),
            taken_over_at: Some(now),
        };
        claims.insert(drone.clone(), claim);
        drop(claims);
        let ended = wire::EndedSession {
            drone_id: words::text(drone),
            session_id: words::text(&held.session.id),
            taken_over_by: words::text(&self.line.id),
        };
        self.edge.lines.leave(&held.session.line, drone);
        held.session.line.lose(drone, ended.clone());
        Ok(Claimed::TakenOver(ended))
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        let drones = self.edge.lines.close(&self.line.line);
        let mut claims = self.edge.claims.lock();
        for drone in drones {
            if claims.get(&drone).is_some_and(|claim| self.holds(claim)) {
                claims.remove(&drone);
            }
        }
    }
}
