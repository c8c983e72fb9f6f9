//! `skyway pack show`: what a pack says, and whether its signature holds.

use super::super::files;
use super::super::output::{Align, Output, facts_table, titled_table};
use super::super::stop::{Stop, Verdict};
use crate::pack::{Advice, Clock, Fault, Hop, KeyId, Leg, Node, Pack, Stop as PackStop, Way};
use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use clap::Args;
use jiff::Timestamp;
use serde_json::{Value, json};
use std::io::Read;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  curl -so a.pack http://127.0.0.1:8080/v1/plans/night-mail/pack
  curl -s http://127.0.0.1:8080/v1/keys > keys.json
  skyway pack show a.pack --keys keys.json
  skyway pack show a.pack --json

Exit codes: 0 when it is shown and its signature holds or was not asked for, 1 when the bytes are no pack or the
signature does not hold, 2 for arguments that make no sense.";

/// Arguments of `skyway pack show`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Show {
    /// The pack, as GET /v1/plans/{id}/pack gives it, or - for standard input
    #[arg(value_name = "FILE")]
    pack: PathBuf,
    /// The keys that are believed: the answer of GET /v1/keys, in a file
    #[arg(long, value_name = "FILE", conflicts_with = "key")]
    keys: Option<PathBuf>,
    /// The one key that is believed: its public half in base64
    #[arg(long, value_name = "KEY")]
    key: Option<String>,
    /// Write JSON
    #[arg(help_heading = "Output", long)]
    json: bool,
}

/// What is known of the signature.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Signed {
    Holds,
    NotChecked,
    /// Nothing that it says is to be believed, and why.
    Not(String),
}

impl Show {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let mut bytes = Vec::new();
        let shown = self.pack.display();
        files::open(&self.pack)?
            .read_to_end(&mut bytes)
            .map_err(|error| Stop::failed(format!("cannot read {shown}: {error}")))?;
        let pack = Pack::read_unverified(&bytes);
        let pack = pack.map_err(|fault| Stop::failed(format!("{shown}: {fault}")))?;
        let signed = self.signed(&pack)?;
        match self.json {
            true => output.json(&as_json(&pack, &signed))?,
            false => {
                output.table(&facts_table(facts(&pack, &signed)))?;
                output.line("")?;
                output.table(&legs(&pack))?;
                output.line(&covered(&pack))?;
            }
        }
        Ok(match signed {
            Signed::Not(_) => Verdict::Negative,
            Signed::Holds | Signed::NotChecked => Verdict::Done,
        })
    }

    fn signed(&self, pack: &Pack<'_>) -> Result<Signed, Stop> {
        let key = match (&self.key, &self.keys) {
            (Some(key), _) => public(key).ok_or_else(|| {
                Stop::Usage("--key is not the 32 bytes of a public key in base64".to_owned())
            })?,
            (None, Some(file)) => match listed(file, pack.key_id())? {
                Ok(key) => key,
                Err(why) => return Ok(Signed::Not(why)),
            },
            (None, None) => return Ok(Signed::NotChecked),
        };
        Ok(match pack.verify(&key) {
            Ok(()) => Signed::Holds,
            Err(fault @ (Fault::Key | Fault::Signature)) => Signed::Not(fault.to_string()),
            Err(fault) => return Err(Stop::failed(fault)),
        })
    }
}

fn public(text: &str) -> Option<[u8; 32]> {
    BASE64.decode(text.trim()).ok()?.try_into().ok()
}

/// The key of an id in the list of an edge, or why it is not to be believed.
fn listed(file: &Path, id: KeyId) -> Result<Result<[u8; 32], String>, Stop> {
    let unreadable = |what: &str| Stop::failed(format!("{}: {what}", file.display()));
    let text = files::read_text(file)?;
    let told: Value =
        serde_json::from_str(&text).map_err(|error| unreadable(&error.to_string()))?;
    let keys = told["keys"].as_array();
    let keys = keys.ok_or_else(|| unreadable("it has no list of keys, as GET /v1/keys answers"))?;
    let Some(key) = keys.iter().find(|key| key["id"] == id.to_string()) else {
        return Ok(Err(format!("the key {id} is not in {}", file.display())));
    };
    if key["state"] == "revoked" {
        return Ok(Err(format!("the key {id} is revoked")));
    }
    let public = key["public_key"].as_str().and_then(public);
    public
        .map(Ok)
        .ok_or_else(|| unreadable("a public key is not 32 bytes in base64"))
}

fn facts(pack: &Pack<'_>, signed: &Signed) -> Vec<(&'static str, String)> {
    let (token, epoch, version) = pack.order();
    vec![
        ("plan", pack.plan().to_owned()),
        (
            "version",
            format!("{version} (epoch {epoch}, token {token})"),
        ),
        ("network", pack.network().to_owned()),
        ("network sha256", hex::encode(pack.network_sha256())),
        ("departs at", instant(pack.departs_ms())),
        ("no departure after", instant(pack.not_after_ms())),
        ("clock", clock(pack).to_owned()),
        ("size", format!("{} bytes", pack.bytes().len())),
        ("key", pack.key_id().to_string()),
        (
            "signature",
            match signed {
                Signed::Holds => "holds".to_owned(),
                Signed::NotChecked => "not checked: name --keys or --key".to_owned(),
                Signed::Not(why) => format!("DOES NOT HOLD: {why}"),
            },
        ),
    ]
}

fn legs(pack: &Pack<'_>) -> comfy_table::Table {
    let mut table = titled_table(&[
        ("leg", Align::Right),
        ("from", Align::Right),
        ("to", Align::Right),
        ("departs", Align::Right),
        ("battery", Align::Right),
        ("if it closes", Align::Left),
        ("alternate", Align::Left),
    ]);
    for (number, leg) in (0..).zip(pack.legs()) {
        let departs = leg
            .departs_ds
            .map(|at| format!("+{:.1} s", f64::from(at) / 10.0));
        let action = match pack.if_closed(number, None) {
            Advice::Detour(way) => detour(&way),
            Advice::Alternate(way) => format!("alternate {}", way.to().index),
            Advice::Unknown(_) => format!("nothing known ({})", leg.detour.name()),
        };
        let alternate = pack.alternate(number);
        table.add_row(vec![
            number.to_string(),
            leg.from.index.to_string(),
            leg.to.index.to_string(),
            departs.unwrap_or_else(|| "-".to_owned()),
            percent(leg.battery_e4),
            action,
            alternate.map_or_else(|| leg.alternate.name().to_owned(), |way| detour(&way)),
        ]);
    }
    table
}

fn detour(way: &Way<'_>) -> String {
    let mut text = String::new();
    let stop = |stop: PackStop| format!(" [charge to {}]", percent(Some(stop.battery_e4)));
    text.extend(way.begins_with().map(stop));
    for hop in way.hops() {
        text += &format!(" {}", hop.to.index);
        text.extend(hop.stop.map(stop));
    }
    match way.rejoins() {
        Some(leg) => text += &format!(", on with leg {leg}"),
        None => text += " land",
    }
    if way.is_reserve_used() {
        text += ", on the reserve";
    }
    text.trim_start().to_owned()
}

fn covered(pack: &Pack<'_>) -> String {
    let known = (0..pack.leg_count())
        .filter(|&leg| !matches!(pack.if_closed(leg, None), Advice::Unknown(_)));
    format!("{} of {} legs are covered", known.count(), pack.leg_count())
}

fn percent(battery_e4: Option<u16>) -> String {
    battery_e4.map_or_else(
        || "-".to_owned(),
        |battery| format!("{:.2} %", f64::from(battery) / 100.0),
    )
}

fn as_json(pack: &Pack<'_>, signed: &Signed) -> Value {
    let (token, epoch, version) = pack.order();
    let legs = (0..).zip(pack.legs());
    json!({
        "plan": pack.plan(),
        "token": token,
        "epoch": epoch,
        "version": version,
        "network": {"name": pack.network(), "sha256": hex::encode(pack.network_sha256())},
        "departs_at": instant(pack.departs_ms()),
        "not_after": instant(pack.not_after_ms()),
        "clock": clock(pack),
        "times": if pack.is_timed() { "computed" } else { "none" },
        "planar": pack.is_planar(),
        "has_first_stretch": pack.has_first_stretch(),
        "bytes": pack.bytes().len(),
        "key": pack.key_id().to_string(),
        "signature": match signed {
            Signed::Holds => "holds",
            Signed::NotChecked => "not_checked",
            Signed::Not(_) => "does_not_hold",
        },
        "legs": legs.map(|(number, leg)| leg_json(pack, number, &leg)).collect::<Vec<_>>(),
    })
}

fn leg_json(pack: &Pack<'_>, number: u16, leg: &Leg) -> Value {
    let action = match pack.if_closed(number, None) {
        Advice::Detour(_) => "detour",
        Advice::Alternate(_) => "alternate",
        Advice::Unknown(_) => "unknown",
    };
    json!({
        "from": node(pack, leg.from),
        "to": node(pack, leg.to),
        "dips_m": leg.dips_half_m.map(|dip| f64::from(dip) / 2.0),
        "departs_after_s": leg.departs_ds.map(|at| f64::from(at) / 10.0),
        "battery_fraction": leg.battery_e4.map(fraction),
        "lands_before": leg.lands_before,
        "if_closed": action,
        "detour": {"state": leg.detour.name(), "way": pack.detour(number).map(|it| way(pack, &it))},
        "alternate": {"state": leg.alternate.name(), "way": pack.alternate(number).map(|it| way(pack, &it))},
    })
}

fn way(pack: &Pack<'_>, way: &Way<'_>) -> Value {
    let hop = |hop: Hop| {
        json!({
            "to": node(pack, hop.to),
            "dips_m": hop.dips_half_m.map(|dip| f64::from(dip) / 2.0),
            "stop": hop.stop.map(stop),
        })
    };
    json!({
        "battery_fraction": way.battery_e4().map(fraction),
        "reserve_used": way.is_reserve_used(),
        "begins_with": way.begins_with().map(stop),
        "hops": way.hops().map(hop).collect::<Vec<_>>(),
        "rejoins_leg": way.rejoins(),
    })
}

fn stop(stop: PackStop) -> Value {
    json!({
        "battery_fraction": fraction(stop.battery_e4),
        "not_before_s": stop.not_before_ds.map(|at| f64::from(at) / 10.0),
    })
}

fn node(pack: &Pack<'_>, node: Node) -> Value {
    let unit = if pack.is_planar() { 1e2 } else { 1e7 };
    json!({
        "index": node.index,
        "location": node.place.map(|coordinate| f64::from(coordinate) / unit),
        "height_m": node.height_dm.map(|height| f64::from(height) / 10.0),
    })
}

fn fraction(battery_e4: u16) -> f64 {
    f64::from(battery_e4) / 1e4
}

fn clock(pack: &Pack<'_>) -> &'static str {
    match pack.clock() {
        Clock::Real => "real",
        Clock::Simulated => "simulated",
        Clock::External => "external",
    }
}

/// An instant that is none is beyond what calendars say.
fn instant(milliseconds: i64) -> String {
    Timestamp::from_millisecond(milliseconds).map_or_else(|_| "-".to_owned(), |at| at.to_string())
}
