//! Why a network is refused, as a refusal with the place of every fault.

use crate::formats::{FormatError, LoadError};
use crate::network::NetworkError;
use crate::refusal::{Code, Refusal};
use crate::wire::Fault;

/// A reader takes in no more than a screen of faults.
const FAULTS_TOLD: usize = 20;

/// A network that cannot be loaded, as a refusal.
pub fn network_refusal(error: LoadError) -> Refusal {
    match error {
        LoadError::Format(errors) => refused(errors.into_iter().map(of_format).collect()),
        LoadError::Network(errors) => network_rejected(errors),
    }
}

/// A network that can be read and not be flown, as a refusal.
pub fn network_rejected(errors: Vec<NetworkError>) -> Refusal {
    let faults = errors.into_iter().map(|error| Fault {
        code: "network_feature_invalid".to_owned(),
        pointer: String::new(),
        message: error.to_string(),
        hint: None,
    });
    refused(faults.collect())
}

fn of_format(error: FormatError) -> Fault {
    let message = match &error.feature {
        Some(feature) => format!("{feature}: {}", error.message),
        None => error.message,
    };
    Fault {
        code: "network_format_invalid".to_owned(),
        pointer: error.pointer,
        message,
        hint: error.hint,
    }
}

fn refused(mut faults: Vec<Fault>) -> Refusal {
    let count = faults.len();
    faults.truncate(FAULTS_TOLD);
    let detail = match faults.as_slice() {
        [only] => only.message.clone(),
        _ => format!("the network has {count} faults"),
    };
    Refusal {
        faults,
        ..Refusal::new(Code::NetworkInvalid, detail)
    }
}
