//! Places for connections: counted by address until somebody says who calls, and by subject from then on, so that none holds
//! all of them; and a few that only probes can use, when all others are taken.
//!
//! Behind a proxy all come from one address: it is their tokens that tell them apart.

use super::ServerConfig;
use crate::access::{Caller, Role};
use crate::api::metrics::CloseReason;
use rustc_hash::FxHashMap;
use std::hash::Hash;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// Places for probes that one address may hold.
const PROBES_OF_AN_ADDRESS: usize = 8;

/// Whom a connection counts for once somebody has said who calls.
type Owner = (Role, Arc<str>);

/// The places of a listener.
#[derive(Debug)]
pub(crate) struct Places {
    most: usize,
    most_of_an_address: usize,
    most_of_a_subject: usize,
    most_for_probes: usize,
    held: Mutex<Held>,
}

#[derive(Debug, Default)]
struct Held {
    all: usize,
    by_address: FxHashMap<IpAddr, usize>,
    by_owner: FxHashMap<Owner, usize>,
    for_probes: usize,
    probes_by_address: FxHashMap<IpAddr, usize>,
}

/// The place of one connection, until it is dropped.
#[derive(Debug)]
pub(crate) struct Place {
    places: Arc<Places>,
    address: IpAddr,
    is_for_probes: bool,
    owner: OnceLock<Owner>,
}

impl Places {
    pub(crate) fn new(config: &ServerConfig) -> Self {
        Self {
            most: config.connections_max,
            most_of_an_address: config.connections_per_address,
            most_of_a_subject: config.connections_per_subject,
            most_for_probes: config.connections_for_probes,
            held: Mutex::default(),
        }
    }

    /// A place for a connection from an address.
    ///
    /// # Errors
    /// Why there is none, not even for a probe.
    pub(crate) fn take(self: &Arc<Self>, address: IpAddr) -> Result<Place, CloseReason> {
        let address = network_of(address);
        let mut held = self.lock();
        let has_room = held.all < self.most;
        let of_address = count(&held.by_address, &address);
        let is_for_probes = !has_room || of_address >= self.most_of_an_address;
        if is_for_probes {
            let of_address = count(&held.probes_by_address, &address);
            if held.for_probes >= self.most_for_probes || of_address >= PROBES_OF_AN_ADDRESS {
                return Err(match has_room {
                    true => CloseReason::Address,
                    false => CloseReason::Cap,
                });
            }
            held.for_probes += 1;
            *held.probes_by_address.entry(address).or_default() += 1;
        } else {
            held.all += 1;
            *held.by_address.entry(address).or_default() += 1;
        }
        Ok(Place {
            places: Arc::clone(self),
            address,
            is_for_probes,
            owner: OnceLock::new(),
        })
    }

    // Counts are whole after every call, so a panic elsewhere cannot spoil them.
    fn lock(&self) -> MutexGuard<'_, Held> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Place {
    /// Whether only probes are answered here.
    pub(crate) fn is_for_probes(&self) -> bool {
        self.is_for_probes
    }

    /// Counts the connection for the first who says who calls, and for its address no more; gives how many such a caller may
    /// have where it has as many already.
    pub(crate) fn belongs_to(&self, caller: &Caller) -> Result<(), usize> {
        // Of a connection that several share it is the first.
        if self.owner.get().is_some() || self.is_for_probes {
            return Ok(());
        }
        let owner = (caller.role, Arc::clone(&caller.subject));
        let mut held = self.places.lock();
        if count(&held.by_owner, &owner) >= self.places.most_of_a_subject {
            return Err(self.places.most_of_a_subject);
        }
        if self.owner.set(owner.clone()).is_ok() {
            *held.by_owner.entry(owner).or_default() += 1;
            release(&mut held.by_address, &self.address);
        }
        Ok(())
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut held = self.places.lock();
        if self.is_for_probes {
            held.for_probes -= 1;
            release(&mut held.probes_by_address, &self.address);
            return;
        }
        held.all -= 1;
        match self.owner.get() {
            Some(owner) => release(&mut held.by_owner, owner),
            None => release(&mut held.by_address, &self.address),
        }
    }
}

fn count<K: Hash + Eq>(counts: &FxHashMap<K, usize>, key: &K) -> usize {
    counts.get(key).copied().unwrap_or_default()
}

fn release<K: Hash + Eq>(counts: &mut FxHashMap<K, usize>, key: &K) {
    if let Some(held) = counts.get_mut(key) {
        *held -= 1;
        if *held == 0 {
            counts.remove(key);
        }
    }
}

/// What one party has at its disposal: an address of version 4, or the 2⁶⁴ of a network of version 6.
fn network_of(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(address) => {
            let network = u128::from(address) >> 64 << 64;
            IpAddr::V6(Ipv6Addr::from(network))
        }
        address => address,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places() -> Arc<Places> {
        Arc::new(Places::new(&ServerConfig {
            connections_max: 5,
            connections_per_address: 2,
            connections_per_subject: 3,
            connections_for_probes: 9,
            ..ServerConfig::default()
        }))
    }

    fn address(text: &str) -> IpAddr {
        text.parse().expect("an address")
    }

    fn drone(subject: &str) -> Caller {
        Caller::local(Role::Drone, subject)
    }

    #[test]
    fn a_connection_counts_for_its_address_until_it_counts_for_a_subject() {
        let places = places();
        let proxy = address("10.0.0.1");
        let acme = drone("acme");
        let mut open = Vec::new();
        for _ in 0..3 {
            let place = places.take(proxy).expect("a place");
            assert!(!place.is_for_probes());
            assert_eq!(place.belongs_to(&acme), Ok(()));
            // Of another that comes over the same connection nothing is counted.
            assert_eq!(place.belongs_to(&drone("other")), Ok(()));
            open.push(place);
        }
        let fourth = places.take(proxy).expect("a place");
        assert_eq!(fourth.belongs_to(&acme), Err(3));
        assert_eq!(fourth.belongs_to(&drone("bolt")), Ok(()));
        open.pop();
        let again = places.take(proxy).expect("a place");
        assert_eq!(again.belongs_to(&acme), Ok(()));
        drop((open, fourth, again));
        let held = places.lock();
        assert_eq!(held.all, 0);
        assert!(held.by_address.is_empty() && held.by_owner.is_empty());
    }

    #[test]
    fn who_holds_all_it_may_has_places_for_probes_alone() {
        let places = places();
        let (mine, other) = (address("2001:db8::1"), address("2001:db8:0:1::1"));
        let held = [address("2001:db8::2"), address("2001:db8::3")].map(|one| places.take(one));
        assert!(places.take(mine).expect("a place").is_for_probes());
        assert!(!places.take(other).expect("a place").is_for_probes());
        let probes: Vec<_> = (0..8).map(|_| places.take(mine)).collect();
        assert!(probes.iter().all(Result::is_ok));
        assert_eq!(places.take(mine).err(), Some(CloseReason::Address));
        let more: Vec<_> = ["1.1.1.1", "1.1.1.2", "1.1.1.3"]
            .map(|one| places.take(address(one)))
            .into();
        assert!(more.iter().flatten().all(|place| !place.is_for_probes()));
        let last = places.take(other).expect("a place");
        assert!(last.is_for_probes());
        assert_eq!(places.take(other).err(), Some(CloseReason::Cap));
        drop((held, probes, more, last));
        let held = places.lock();
        assert_eq!((held.all, held.for_probes), (0, 0));
        assert!(held.probes_by_address.is_empty());
    }
}
