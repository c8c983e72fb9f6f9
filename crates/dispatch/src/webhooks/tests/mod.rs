//! The sender over endpoints on this machine, with a store in memory and a clock that is moved by hand.

mod memory;
mod receiver;

use super::endpoint::Endpoint;
use super::guard::{Found, GuardedNames, Names, Reach};
use super::notes::Notes;
use super::outgoing::{Outcome, Outgoing, Signed};
use super::sender::Sender;
use jiff::Timestamp;
use memory::Memory;
use receiver::{Answering, Receiver};
use skyway_contract::{WebhookDraft, WebhookState};
use skyway_registry::documents::{Commit, Document, DocumentKind, Documents, Message, Settlement};
use skyway_service::clock::{Clock, ManualClock};
use std::net::{IpAddr, Ipv4Addr};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use tokio::net::TcpListener;
use tokio::sync::Notify;
use tokio::task::JoinHandle;

const HOOK: &str = "shop:main";
/// A webhook whose endpoint never answers.
const HANGING: &str = "shop:hanging";
const START: i64 = 1_800_000_000_000;

/// A sender that runs, and its endpoint.
struct Desk {
    documents: Arc<Memory>,
    receiver: Receiver,
    endpoint: Endpoint,
    hand: ManualClock,
    clock: Clock,
    news: Arc<Notify>,
    running: JoinHandle<()>,
}

impl Desk {
    async fn start(answering: Answering) -> Self {
        let documents = Arc::new(Memory::default());
        let receiver = Receiver::start(answering).await;
        let start = Timestamp::from_millisecond(START).expect("an instant");
        let (clock, hand) = Clock::by_hand(start);
        let endpoint = Endpoint::new(&WebhookDraft {
            url: receiver.url(),
            events: Vec::new(),
        });
        let endpoint = endpoint.expect("random bits");
        let sender = Arc::new(Sender {
            documents: documents.clone(),
            notes: Notes::new(documents.clone()),
            clock: clock.clone(),
            outgoing: Outgoing::new(&GuardedNames::of_system(true)),
        });
        let news = Arc::new(Notify::new());
        let told = news.clone();
        let desk = Self {
            documents,
            receiver,
            endpoint,
            hand,
            clock,
            news,
            running: tokio::spawn(async move { sender.run(&told).await }),
        };
        let document = desk.endpoint.document(HOOK, "shop", 1, START);
        desk.commit(vec![document.expect("has a JSON form")], Vec::new())
            .await;
        desk
    }

    async fn commit(&self, puts: Vec<Document>, messages: Vec<Message>) {
        let commit = Commit {
            puts,
            messages,
            ..Commit::default()
        };
        self.documents.commit(&commit).await.expect("is in memory");
        self.news.notify_one();
    }

    async fn tell(&self, subject: &str, numbers: std::ops::RangeInclusive<u64>) {
        let now_ms = self.clock.now().as_millisecond();
        let messages = numbers.map(|number| message(subject, number, now_ms));
        self.commit(Vec::new(), messages.collect()).await;
    }

    /// A message once it is settled, or was sent so often; the clock moves on to when it is due.
    async fn settled(&self, subject: &str, number: u64, attempts: u32) -> Message {
        loop {
            let found = self.documents.message(&id(subject, number)).await;
            let message = found.expect("is in memory").expect("was told");
            if message.state != "pending" || message.attempts == attempts {
                return message;
            }
            let due = Timestamp::from_millisecond(message.due_ms).expect("an instant");
            if self.clock.now() < due {
                self.hand.set(due);
                self.news.notify_one();
            }
            tokio::task::yield_now().await;
        }
    }

    async fn webhook(&self) -> Endpoint {
        let kind = DocumentKind::Webhook;
        let document = self.documents.document(kind, HOOK).await;
        let document = document.expect("is in memory").expect("is there");
        Endpoint::of(&document).expect("can be read")
    }
}

impl Drop for Desk {
    fn drop(&mut self) {
        self.running.abort();
    }
}

fn id(subject: &str, number: u64) -> String {
    format!("msg_{subject}_{number}")
}

fn message(subject: &str, number: u64, now_ms: i64) -> Message {
    Message {
        id: id(subject, number),
        webhook: HOOK.to_owned(),
        subject: subject.to_owned(),
        number,
        event: "delivery.assigned".to_owned(),
        body: format!("{{\"data\":\"{subject} {number}\"}}"),
        created_ms: now_ms,
        due_ms: now_ms,
        attempts: 0,
        state: "pending".to_owned(),
        last_outcome: None,
    }
}

#[tokio::test]
async fn what_is_refused_is_sent_again_signed_anew_and_before_what_follows() {
    let answering: Answering = |number| {
        if number % 2 == 0 {
            "503 Busy"
        } else {
            "204 Taken"
        }
    };
    let desk = Desk::start(answering).await;
    desk.tell("d-1", 1..=3).await;
    for number in 1..=3 {
        let message = desk.settled("d-1", number, u32::MAX).await;
        assert_eq!((message.state.as_str(), message.attempts), ("delivered", 2));
        assert_eq!(message.last_outcome.as_deref(), Some("answered 204"));
    }
    let calls = desk.receiver.calls();
    let told: Vec<&str> = calls.iter().map(|call| call.header("webhook-id")).collect();
    let (one, two, three) = (id("d-1", 1), id("d-1", 2), id("d-1", 3));
    assert_eq!(told, [&one, &one, &two, &two, &three, &three]);
    for call in calls {
        let sent_at_s: i64 = call.header("webhook-timestamp").parse().expect("seconds");
        let sent_at = Timestamp::from_second(sent_at_s).expect("an instant");
        let expected = desk
            .endpoint
            .sign(call.header("webhook-id"), sent_at, &call.body);
        assert_eq!(call.header("webhook-signature"), expected);
        assert_eq!(call.header("content-type"), "application/json");
    }
}

#[tokio::test]
async fn who_answers_gone_is_called_no_more() {
    let desk = Desk::start(|_| "410 Gone").await;
    desk.tell("d-1", 1..=2).await;
    let first = desk.settled("d-1", 1, u32::MAX).await;
    assert_eq!((first.state.as_str(), first.attempts), ("given_up", 1));
    let second = desk.settled("d-1", 2, u32::MAX).await;
    assert_eq!(
        second.last_outcome.as_deref(),
        Some("the webhook is disabled")
    );
    assert_eq!(desk.webhook().await.state, WebhookState::Disabled);
    assert_eq!(desk.receiver.calls().len(), 1);
}

#[tokio::test]
async fn who_takes_nothing_for_a_day_is_disabled() {
    // A redirect is no answer, and is not followed.
    let desk = Desk::start(|_| "302 Found\r\nlocation: /elsewhere").await;
    desk.tell("d-1", 1..=1).await;
    let message = desk.settled("d-1", 1, u32::MAX).await;
    assert_eq!((message.state.as_str(), message.attempts), ("given_up", 59));
    assert_eq!(message.last_outcome.as_deref(), Some("answered 302"));
    let webhook = desk.webhook().await;
    assert_eq!(webhook.state, WebhookState::Disabled);
    assert_eq!(webhook.reason.as_deref(), Some("it took nothing for a day"));
}

#[tokio::test]
async fn who_takes_something_else_within_the_day_is_not_disabled() {
    // The last attempt but one, by then another message, is taken.
    let answering: Answering = |number| {
        if number == 58 {
            "200 Taken"
        } else {
            "500 Broken"
        }
    };
    let desk = Desk::start(answering).await;
    desk.tell("d-1", 1..=1).await;
    desk.settled("d-1", 1, 58).await;
    // Until the clock moves on, the first waits.
    while desk.receiver.calls().len() < 58 {
        tokio::task::yield_now().await;
    }
    desk.tell("d-2", 1..=1).await;
    assert_eq!(desk.settled("d-2", 1, u32::MAX).await.state, "delivered");
    assert_eq!(desk.settled("d-1", 1, u32::MAX).await.state, "given_up");
    assert_eq!(desk.webhook().await.state, WebhookState::Active);
}

/// Puts webhooks that are connected to and never answered; gives where each goes, which has to be kept.
async fn hang(desk: &Desk, webhooks: &[String], each: usize) -> TcpListener {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let address = listener.local_addr().expect("has an address");
    let endpoint = Endpoint::new(&WebhookDraft {
        url: format!("http://{address}/"),
        events: Vec::new(),
    });
    let endpoint = endpoint.expect("random bits");
    for webhook in webhooks {
        let document = endpoint.document(webhook, "shop", 1, START);
        let waiting = (0..each).map(|number| Message {
            id: format!("{webhook}-{number}"),
            webhook: webhook.clone(),
            // For longer than the other's.
            due_ms: START - 1_000,
            ..message(&format!("h-{number:03}"), 1, START)
        });
        let waiting = waiting.collect();
        desk.commit(vec![document.expect("has a JSON form")], waiting)
            .await;
    }
    listener
}

/// How many messages to a webhook that hangs are being sent.
async fn calls(desk: &Desk, webhook: &str) -> usize {
    let hanging = desk.documents.messages(webhook, None, 1_000).await;
    let hanging = hanging.expect("is in memory");
    assert!(hanging.iter().all(|message| message.state == "pending"));
    assert!(hanging.iter().all(|message| message.last_outcome.is_none()));
    hanging
        .iter()
        .filter(|message| message.attempts > 0)
        .count()
}

#[tokio::test]
async fn who_never_answers_takes_the_place_of_no_other() {
    let desk = Desk::start(|_| "200 Taken").await;
    // More than are looked at, or sent, at once.
    let hanging = [HANGING.to_owned()];
    let _listener = hang(&desk, &hanging, 400).await;
    desk.tell("d-1", 1..=3).await;
    for number in 1..=3 {
        let message = desk.settled("d-1", number, u32::MAX).await;
        assert_eq!(message.state, "delivered");
    }
    assert!((1..=32).contains(&calls(&desk, HANGING).await));
}

#[tokio::test]
async fn many_that_never_answer_leave_places_for_another() {
    let desk = Desk::start(|_| "200 Taken").await;
    let hanging: Vec<String> = (0..20)
        .map(|number| format!("shop:h-{number:02}"))
        .collect();
    let _listener = hang(&desk, &hanging, 40).await;
    desk.tell("d-1", 1..=3).await;
    for number in 1..=3 {
        let message = desk.settled("d-1", number, u32::MAX).await;
        assert_eq!(message.state, "delivered");
    }
    let mut all = 0;
    for webhook in &hanging {
        let calls = calls(&desk, webhook).await;
        assert!(calls >= 1, "{webhook} is called too");
        all += calls;
    }
    assert!(all < 256, "{all}");
}

#[tokio::test]
async fn what_another_process_sends_is_not_sent() {
    let desk = Desk::start(|_| "200 Taken").await;
    desk.documents.overtake();
    desk.tell("d-1", 1..=2).await;
    // The other one never says what became of it, so it is sent once its time has come again.
    let first = desk.settled("d-1", 1, u32::MAX).await;
    assert_eq!((first.state.as_str(), first.attempts), ("delivered", 2));
    assert_eq!(desk.settled("d-1", 2, u32::MAX).await.state, "delivered");
    let calls = desk.receiver.calls();
    let told: Vec<&str> = calls.iter().map(|call| call.header("webhook-id")).collect();
    assert_eq!(told, [id("d-1", 1), id("d-1", 2)]);
}

/// Names whose only one is public when it is first asked for, and this machine's from then on.
#[derive(Debug, Default)]
struct Turncoat(AtomicUsize);

impl Names for Turncoat {
    fn addresses<'a>(&'a self, _: &'a str) -> Found<'a> {
        let asked_before = self.0.fetch_add(1, Ordering::Relaxed);
        let address = match asked_before {
            0 => Ipv4Addr::new(198, 41, 0, 4),
            _ => Ipv4Addr::LOCALHOST,
        };
        Box::pin(async move { Ok(vec![IpAddr::V4(address)]) })
    }
}

fn signed() -> Signed {
    Signed {
        id: "msg_1".to_owned(),
        sent_at_s: 1,
        signature: "v1,a".to_owned(),
        body: "{}".to_owned(),
    }
}

#[tokio::test]
async fn a_name_that_changes_its_mind_leads_nowhere_inside() {
    let receiver = Receiver::start(|_| "200 Taken").await;
    let turncoat = Arc::new(Turncoat::default());
    let names = GuardedNames {
        names: turncoat.clone(),
        reach: Reach::Public,
    };
    let url = format!("https://hooks.example:{}/", receiver.address.port());
    assert_eq!(names.check(&url).await, Ok(()));
    let outcome = Outgoing::new(&names).send(&url, &signed()).await;
    let expected = "'hooks.example' has no public address".to_owned();
    assert_eq!(outcome, Outcome::Failed(expected));
    assert_eq!(turncoat.0.load(Ordering::Relaxed), 2);
    assert!(receiver.calls().is_empty());
}

#[tokio::test]
async fn a_name_is_asked_for_once_and_what_was_checked_is_called() {
    let receiver = Receiver::start(|_| "200 Taken").await;
    let turncoat = Arc::new(Turncoat(AtomicUsize::new(1)));
    let names = GuardedNames {
        names: turncoat.clone(),
        reach: Reach::Anywhere,
    };
    let url = format!("http://hooks.example:{}/", receiver.address.port());
    let outcome = Outgoing::new(&names).send(&url, &signed()).await;
    assert!(matches!(outcome, Outcome::Taken(_)), "{outcome:?}");
    assert_eq!(turncoat.0.load(Ordering::Relaxed), 2);
    assert_eq!(receiver.calls().len(), 1);
}

#[tokio::test]
async fn notes_that_come_during_a_write_are_written_with_the_next_one() {
    let documents = Arc::new(Memory::default());
    let notes = Arc::new(Notes::new(documents.clone()));
    let note_all = |subject: &'static str| {
        let notes = notes.clone();
        let mut noting = tokio::task::JoinSet::new();
        for number in 1..=20 {
            let notes = notes.clone();
            let settlement = Settlement {
                message: message(subject, number, START),
                attempts_before: Some(0),
            };
            noting.spawn(async move { notes.note(settlement).await });
        }
        noting.join_all()
    };
    let noted = note_all("a").await;
    assert!(noted.iter().all(Result::is_ok), "{noted:?}");
    assert_eq!(documents.settlements(), 2);
    for number in 1..=20 {
        let found = documents.message(&id("a", number)).await;
        assert!(found.expect("is in memory").is_some(), "{number}");
    }

    documents.break_down();
    let noted = note_all("b").await;
    assert!(noted.iter().all(Result::is_err), "{noted:?}");
}
