//! A session: what drones say on it is carried out in its order; what they are told goes between.
//!
//! There is no task and no queue behind it: requests are read as answers are taken, so that who does not read is not
//! heard either, and costs nothing.

use super::clock::advance;
use super::convert::{FromProto, IntoProto};
use super::convert_report::parsed_report;
use super::drones::telemetry;
use super::plans::{acknowledge, complete, decline};
use super::proto::{self, SessionRequest, SessionResponse};
use super::proto::{session_request::Body as Said, session_response::Body as Told};
use super::requests::invalid;
use crate::access::Caller;
use crate::api::operations::Operation;
use crate::api::problem::{document, grpc_status};
use crate::api::server::unread;
use crate::edge::{Code, Edge, Mail, MailStream, Refusal, Session};
use crate::wire;
use std::mem;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::time::{Instant, Sleep, sleep};
use tokio_stream::Stream;
use tonic::{Status, Streaming};

/// So soon a session needs a drone, from its beginning or since its last one left; one without drones is ended.
const HELLO_WITHIN: Duration = Duration::from_secs(10);
/// So many requests are carried out before others have the thread.
const IN_A_ROW: usize = 32;

/// The answer to a request, as it comes; none where none is asked for.
type Answering = Pin<Box<dyn Future<Output = Option<SessionResponse>> + Send>>;

/// A session, as its client sees it.
pub(super) struct Conversation {
    requests: Streaming<SessionRequest>,
    speaker: Speaker,
    mail: MailStream,
    answering: Option<Answering>,
    answer: Option<SessionResponse>,
    hello_by: Pin<Box<Sleep>>,
    had_drones: bool,
    has_ended: bool,
}

/// Who speaks, and on which session.
#[derive(Clone)]
struct Speaker {
    edge: Arc<Edge>,
    caller: Caller,
    session: Arc<Session>,
    request_id: Arc<str>,
}

impl Conversation {
    pub(super) fn begin(
        edge: &Arc<Edge>,
        caller: Caller,
        request_id: String,
        requests: Streaming<SessionRequest>,
    ) -> Self {
        let session = Arc::new(edge.begin_session(&caller));
        Self {
            requests,
            mail: session.mail(),
            speaker: Speaker {
                edge: edge.clone(),
                caller,
                session,
                request_id: Arc::from(request_id),
            },
            answering: None,
            answer: None,
            hello_by: Box::pin(sleep(HELLO_WITHIN)),
            had_drones: false,
            has_ended: false,
        }
    }

    /// Goes on with the requests until there is something to tell; what comes into mailboxes goes first.
    fn go_on(
        &mut self,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<SessionResponse, Status>>> {
        for _ in 0..IN_A_ROW {
            // Nobody is told anything before the welcome.
            if let Some(welcome) = self.answer.take_if(|answer| is_welcome(answer)) {
                return Poll::Ready(Some(Ok(welcome)));
            }
            if let Poll::Ready(Some(mail)) = Pin::new(&mut self.mail).poll_next(context) {
                return Poll::Ready(Some(Ok(told(mail))));
            }
            if let Some(answer) = self.answer.take() {
                return Poll::Ready(Some(Ok(answer)));
            }
            if let Some(answering) = &mut self.answering {
                let Poll::Ready(answer) = answering.as_mut().poll(context) else {
                    return Poll::Pending;
                };
                // What the request has led to for its drones is told before its answer.
                (self.answering, self.answer) = (None, answer);
                continue;
            }
            match Pin::new(&mut self.requests).poll_next(context) {
                Poll::Ready(Some(Ok(request))) => {
                    let speaker = self.speaker.clone();
                    self.answering = Some(Box::pin(speaker.hear(request)));
                }
                Poll::Ready(Some(Err(status))) => {
                    // The gate, which tells tonic's words in ours, sees no end of a session.
                    let refusal = unread(&status);
                    let status = refusal.map_or(status, |refusal| grpc_status(&refusal));
                    return Poll::Ready(Some(Err(status)));
                }
                Poll::Ready(None) => return Poll::Ready(None),
                Poll::Pending => return self.await_hello(context),
            }
        }
        context.waker().wake_by_ref();
        Poll::Pending
    }

    fn await_hello(
        &mut self,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<SessionResponse, Status>>> {
        if self.speaker.session.drone_count() > 0 {
            self.had_drones = true;
            return Poll::Pending;
        }
        if mem::take(&mut self.had_drones) {
            self.hello_by.as_mut().reset(Instant::now() + HELLO_WITHIN);
        }
        if self.hello_by.as_mut().poll(context).is_pending() {
            return Poll::Pending;
        }
        let detail = format!(
            "no drone came on the line within {} s: begin a session with a hello",
            HELLO_WITHIN.as_secs()
        );
        let refusal = Refusal::new(Code::DeadlineExceeded, detail);
        Poll::Ready(Some(Err(grpc_status(&refusal))))
    }
}

impl Stream for Conversation {
    type Item = Result<SessionResponse, Status>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        if self.has_ended {
            return Poll::Ready(None);
        }
        let next = self.go_on(context);
        self.has_ended = matches!(next, Poll::Ready(None | Some(Err(_))));
        next
    }
}

fn is_welcome(answer: &SessionResponse) -> bool {
    matches!(answer.body, Some(Told::Welcome(_)))
}

fn told(mail: Mail) -> SessionResponse {
    SessionResponse {
        request_id: None,
        body: Some(match mail {
            Mail::Message(message) => Told::Message(message.into_proto()),
            Mail::Ended(ended) => Told::Ended(ended.into_proto()),
        }),
    }
}

impl Speaker {
    /// Carries out a request.
    async fn hear(self, request: SessionRequest) -> Option<SessionResponse> {
        self.session.heard();
        let request_id = request.request_id;
        let is_asked = request_id.is_some();
        let body = match self.carry_out(request.body, is_asked).await {
            Ok(body) => body?,
            Err(refusal) => {
                let document = document(&refusal, Some(&self.request_id));
                Told::Problem(document.into_proto())
            }
        };
        Some(SessionResponse {
            request_id,
            body: Some(body),
        })
    }

    async fn carry_out(&self, said: Option<Said>, is_asked: bool) -> Result<Option<Told>, Refusal> {
        let (edge, caller) = (&self.edge, &self.caller);
        let told = match said {
            None => {
                let message = "the request says nothing that is known here".to_owned();
                return Err(invalid("missing", "/body", message));
            }
            Some(Said::Hello(hello)) => {
                let drones = hello.drones.into_iter().map(wire::HelloDrone::from_proto);
                let drones = drones.collect::<Result<Vec<_>, _>>();
                let unreadable = |error: super::convert::Unreadable| {
                    invalid("wrong_type", "/hello/drones", error.to_string())
                };
                let welcome = self.session.hello(drones.map_err(unreadable)?)?;
                return Ok(Some(Told::Welcome(welcome.into_proto())));
            }
            Some(Said::Goodbye(goodbye)) => {
                self.session.goodbye(&goodbye.drone_ids);
                Told::Goodbye(proto::GoodbyeResponse {})
            }
            Some(Said::Telemetry(message)) => {
                let mut answer = edge.telemetry(caller, telemetry(message)).await?;
                if !is_asked {
                    answer
                        .positions
                        .retain(|position| !position.accepted || !position.warnings.is_empty());
                    let is_empty = answer.positions.is_empty();
                    return Ok((!is_empty).then(|| Told::Telemetry(answer.into_proto())));
                }
                Told::Telemetry(answer.into_proto())
            }
            Some(Said::Failure(report)) => {
                let answered = edge.report_failure(caller, parsed_report(report)).await?;
                return Ok(Some(Told::Recomposition(answered.to_wire().into_proto())));
            }
            Some(Said::Acknowledge(message)) => {
                Told::Plan(acknowledge(edge, caller, message).await?.into_proto())
            }
            Some(Said::Decline(message)) => {
                Told::Plan(decline(edge, caller, message).await?.into_proto())
            }
            Some(Said::Complete(message)) => {
                Told::Plan(complete(edge, caller, message).await?.into_proto())
            }
            Some(Said::Received(message)) => {
                let received = wire::Received {
                    through: message.through,
                };
                let left = edge.receive_mail(caller, &message.drone_id, &received);
                Told::MailLeft(left.await?.into_proto())
            }
            Some(Said::AdvanceTo(message)) => {
                may_advance(caller)?;
                let advanced = edge.advance_clock(caller, &advance(&message)?).await?;
                Told::Clock(advanced.into_proto())
            }
        };
        Ok(is_asked.then_some(told))
    }
}

/// Who is on the line may not therefore move the clock.
fn may_advance(caller: &Caller) -> Result<(), Refusal> {
    let operation = Operation::AdvanceClock;
    if operation.allows(caller.role) {
        return Ok(());
    }
    let (role, what) = (caller.role.name(), operation.row().name);
    let detail = format!("the role '{role}' may not {what}");
    Err(Refusal::new(Code::Forbidden, detail))
}
