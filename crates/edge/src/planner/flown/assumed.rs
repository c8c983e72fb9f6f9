//! What of a flight is a default, as neither client nor telemetry said it.

use std::borrow::Cow;

/// What a flight rests on that is a default: neither the client said it, nor telemetry lately.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Assumed {
    pub(crate) airframe: bool,
    pub(crate) battery: bool,
}

impl Assumed {
    /// The same where a report names the airframe, or states the battery.
    pub(super) fn but_for(self, is_airframe_named: bool, is_battery_stated: bool) -> Self {
        Self {
            airframe: self.airframe && !is_airframe_named,
            battery: self.battery && !is_battery_stated,
        }
    }

    /// What is a default in either.
    #[must_use]
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            airframe: self.airframe || other.airframe,
            battery: self.battery || other.battery,
        }
    }

    /// How certain the energy of a flight is that rests on this, and the names of the defaults, in the words of the wire.
    pub(crate) fn told(self) -> (Cow<'static, str>, Vec<Cow<'static, str>>) {
        let all = [(self.airframe, "airframe"), (self.battery, "battery")];
        let assumed = all.into_iter().filter(|(is_assumed, _)| *is_assumed);
        let names: Vec<_> = assumed.map(|(_, name)| Cow::Borrowed(name)).collect();
        let energy = if names.is_empty() {
            "checked"
        } else {
            "assumed"
        };
        (Cow::Borrowed(energy), names)
    }
}
