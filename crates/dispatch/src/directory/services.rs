//! Services: what providers offer, where, when, and for how much.

use super::personal_data::open_delivery;
use super::{
    AIRFRAME_BYTES_MAX, Checked, Entry, Place, check_name, check_payload, check_repeated,
    tenant_before_colon,
};
use crate::Dispatch;
use skyway_contract::{PublishedService, ServiceQuality};
use skyway_engine::network::Topology;
use skyway_market::area::Area;
use skyway_market::hours::{Hours, HoursError};
use skyway_market::tariff::{self, TariffError};
use skyway_registry::documents::{DocumentKind, Unless};
use skyway_service::access::{Caller, Role};
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};

/// How late a delivery may be and count as in time, at most, in seconds.
const TOLERANCE_MAX_S: f64 = 86_400.0;
/// The largest area, in bytes of its JSON.
const AREA_BYTES_MAX: usize = 64 << 10;

impl Entry for PublishedService {
    const KIND: DocumentKind = DocumentKind::Service;
    const IS_OFFERED: bool = true;
    const OF_TENANT_MAX: u64 = 200;
    const MAX: u64 = 2_000;

    /// An id begins with its provider, so that no provider learns which names others have. Without tokens there is one
    /// provider where none is named.
    fn tenant(&self, caller: &Caller, id: &str) -> Result<String, Refusal> {
        if caller.role == Role::Anyone && !id.contains(':') {
            let mut faults = Faults::default();
            faults.id("{id}", Some(id));
            faults.check(Code::ParameterInvalid, "id")?;
            let stated = caller.acts_for(self.provider.as_deref());
            return Ok(stated.unwrap_or_default().to_owned());
        }
        tenant_before_colon(caller, Self::KIND, id)
    }

    fn checked<'a>(
        self,
        dispatch: &'a Dispatch,
        place: Place<'a>,
        _before: Option<&'a Self>,
    ) -> Checked<'a, Self> {
        Box::pin(check(self, dispatch, place))
    }

    fn shown(self, _caller: &Caller, _tenant: &str) -> Self {
        self
    }

    fn unless(place: Place<'_>) -> Option<Unless> {
        Some(open_delivery(place.tenant, place.id))
    }

    fn check_unused<'a>(&'a self, dispatch: &'a Dispatch, place: Place<'a>) -> Checked<'a, ()> {
        Box::pin(dispatch.check_no_open_delivery(place.tenant, Some(place.id)))
    }
}

async fn check(
    mut service: PublishedService,
    dispatch: &Dispatch,
    place: Place<'_>,
) -> Result<PublishedService, Refusal> {
    let mut faults = Faults::default();
    check_repeated(&mut faults, "/id", service.id.as_deref(), place.id);
    let provider = service.provider.as_deref();
    check_repeated(&mut faults, "/provider", provider, place.tenant);
    check_name(&mut faults, &service.name);
    check_payload(&mut faults, service.payload_max_kg);
    faults.text("/airframe", service.airframe.as_deref(), AIRFRAME_BYTES_MAX);
    check_hours(&mut faults, &service);
    check_tariff(&mut faults, &service);
    if let Some(quality) = &service.quality {
        check_quality(&mut faults, quality);
    }
    let from = faults.instant("/valid_from", service.valid_from.as_deref());
    let until = faults.instant("/valid_until", service.valid_until.as_deref());
    if let (Some(from), Some(until)) = (from, until)
        && until <= from
    {
        let message = format!("the service ends at {until}, not after it begins");
        faults.add("window_reversed", "/valid_until", message, None);
    }
    if let Some(topology) = dispatch.network_of(&service.network, &mut faults).await? {
        check_area(&mut faults, &service, &topology);
    }
    faults.check(Code::BodyInvalid, PublishedService::KIND.name())?;
    service.id = Some(place.id.to_owned());
    service.provider = Some(place.tenant.to_owned());
    Ok(service)
}

fn check_hours(faults: &mut Faults, service: &PublishedService) {
    let Err(error) = Hours::read(&service.time_zone, &service.hours) else {
        return;
    };
    let (code, pointer) = match &error {
        HoursError::TimeZone { .. } => ("time_zone_unknown", "/time_zone".to_owned()),
        HoursError::Day { window, .. } => ("day_unknown", format!("/hours/{window}/days")),
        HoursError::Time { window, .. } | HoursError::Empty { window } => {
            ("hours_invalid", format!("/hours/{window}"))
        }
        HoursError::TooMany { .. } => ("hours_invalid", "/hours".to_owned()),
    };
    faults.add(code, &pointer, error.to_string(), None);
}

fn check_tariff(faults: &mut Faults, service: &PublishedService) {
    let Err(error) = tariff::check(&service.tariff) else {
        return;
    };
    let (code, pointer) = match &error {
        TariffError::Currency { .. } => ("currency_invalid", "/tariff/currency".to_owned()),
        TariffError::Amount { part, .. } => ("out_of_range", format!("/tariff/{part}")),
        TariffError::Carriage => ("tariff_invalid", "/tariff".to_owned()),
    };
    faults.add(code, &pointer, error.to_string(), None);
}

fn check_quality(faults: &mut Faults, quality: &ServiceQuality) {
    faults.fraction("/quality/on_time_fraction", Some(quality.on_time_fraction));
    let tolerance_s = Some(quality.tolerance_s);
    faults.number("/quality/tolerance_s", tolerance_s, 0.0, TOLERANCE_MAX_S);
}

fn check_area(faults: &mut Faults, service: &PublishedService, topology: &Topology) {
    let Some(area) = &service.area else {
        return;
    };
    let bytes = area.to_string().len();
    if bytes > AREA_BYTES_MAX {
        let message = format!("the area has {bytes} bytes, more than {AREA_BYTES_MAX}");
        let hint = "take fewer corners".to_owned();
        faults.add("area_too_large", "/area", message, Some(hint));
        return;
    }
    if let Err(error) = Area::read(area, topology.frame()) {
        faults.add("area_invalid", "/area", error.to_string(), None);
    }
}
