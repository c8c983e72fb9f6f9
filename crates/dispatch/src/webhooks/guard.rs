//! Where webhooks may be: at public addresses, so that no one reaches through the registry what only it can reach.
//!
//! A URL is looked at when it is put and at each attempt. The addresses of a name are looked at where the connection
//! takes them from, so that a name that means something else a moment later leads nowhere inside.

use reqwest::Url;
use reqwest::dns::{Addrs, Name, Resolve, Resolving};
use std::fmt::Debug;
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::pin::Pin;
use std::sync::Arc;
use thiserror::Error;

/// The longest URL, in bytes.
const URL_BYTES_MAX: usize = 2_000;

/// Why a webhook cannot be there. What a private name means is not told: who asks could learn the network by it.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub(super) enum UnfitUrl {
    #[error("it is no URL: {0}")]
    Unreadable(String),
    #[error("it has more than {URL_BYTES_MAX} bytes")]
    TooLong,
    #[error("it has the scheme '{0}'; only https is called")]
    Scheme(String),
    #[error("it has a user or a password; who is called knows the registry by the signature")]
    Credentials,
    #[error("'{0}' has no public address")]
    NotPublic(String),
}

/// Where webhooks may be called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// By https, at public addresses.
    Public,
    /// Also without encryption, and at any address.
    Anywhere,
}

impl Reach {
    /// Reads a URL and checks all of it that needs no resolving.
    pub(super) fn check_url(self, text: &str) -> Result<Url, UnfitUrl> {
        if text.len() > URL_BYTES_MAX {
            return Err(UnfitUrl::TooLong);
        }
        let url: Url = text
            .parse()
            .map_err(|error| UnfitUrl::Unreadable(format!("{error}")))?;
        let is_scheme_fit = match self {
            Self::Public => url.scheme() == "https",
            Self::Anywhere => ["https", "http"].contains(&url.scheme()),
        };
        if !is_scheme_fit {
            return Err(UnfitUrl::Scheme(url.scheme().to_owned()));
        }
        if !url.username().is_empty() || url.password().is_some() {
            return Err(UnfitUrl::Credentials);
        }
        let host = url.host_str().unwrap_or_default();
        if let Some(address) = literal(host)
            && !self.allows(address)
        {
            return Err(UnfitUrl::NotPublic(host.to_owned()));
        }
        Ok(url)
    }

    fn allows(self, address: IpAddr) -> bool {
        self == Self::Anywhere || is_public(address)
    }
}

/// The address that a host is, where it is no name; the parser of URLs has written all its spellings as one.
fn literal(host: &str) -> Option<IpAddr> {
    let bare = host.trim_start_matches('[').trim_end_matches(']');
    bare.parse().ok()
}

/// Whether an address is one of the public internet: whether IANA's registries of special addresses (RFC 6890 and
/// after) leave it out.
pub(super) fn is_public(address: IpAddr) -> bool {
    match address {
        IpAddr::V4(address) => is_public_v4(address),
        IpAddr::V6(address) => is_public_v6(address),
    }
}

fn is_public_v4(address: Ipv4Addr) -> bool {
    let is_special = match address.octets() {
        // "This" network, private, loopback.
        [0 | 10 | 127, ..] => true,
        // Shared by carriers (RFC 6598).
        [100, second, ..] => (64..128).contains(&second),
        // Link-local; there clouds tell their machines secrets.
        [169, 254, ..] => true,
        [172, second, ..] => (16..32).contains(&second),
        // Assignments of the IETF, documentation, relays of 6to4, private.
        [192, 0, 0 | 2, _] | [192, 88, 99, _] | [192, 168, ..] => true,
        // Benchmarks, documentation.
        [198, 18 | 19, ..] | [198, 51, 100, _] | [203, 0, 113, _] => true,
        // Multicast, reserved, broadcast.
        [first, ..] => first >= 224,
    };
    !is_special
}

fn is_public_v6(address: Ipv6Addr) -> bool {
    let segments = address.segments();
    // Outside of 2000::/3 are loopback, unique-local, link-local and multicast addresses, and those with an IPv4 address
    // in them: mapped, compatible, NAT64.
    let is_global_unicast = segments[0] >> 13 == 1;
    let is_special = match segments {
        // Assignments of the IETF, among them Teredo; documentation; 6to4; documentation.
        [0x2001, second, ..] => second < 0x0200 || second == 0x0db8,
        [0x2002, ..] => true,
        [0x3fff, second, ..] => second < 0x1000,
        _ => false,
    };
    is_global_unicast && !is_special
}

/// The addresses of a name, once they are known.
pub(super) type Found<'a> = Pin<Box<dyn Future<Output = io::Result<Vec<IpAddr>>> + Send + 'a>>;

/// What knows the addresses of names.
pub(super) trait Names: Debug + Send + Sync {
    /// The addresses of a name.
    fn addresses<'a>(&'a self, name: &'a str) -> Found<'a>;
}

/// The system's names.
#[derive(Debug)]
pub(super) struct SystemNames;

impl Names for SystemNames {
    fn addresses<'a>(&'a self, name: &'a str) -> Found<'a> {
        Box::pin(async move {
            let found = tokio::net::lookup_host((name, 0)).await?;
            Ok(found.map(|address| address.ip()).collect())
        })
    }
}

/// Names whose addresses are all allowed; of others it tells nothing.
#[derive(Clone, Debug)]
pub(super) struct GuardedNames {
    pub(super) names: Arc<dyn Names>,
    pub(super) reach: Reach,
}

impl GuardedNames {
    /// The system's, in reach.
    pub(super) fn of_system(is_anywhere: bool) -> Self {
        Self {
            names: Arc::new(SystemNames),
            reach: match is_anywhere {
                true => Reach::Anywhere,
                false => Reach::Public,
            },
        }
    }

    /// The addresses of a name, at least one.
    pub(super) async fn addresses(&self, name: &str) -> Result<Vec<IpAddr>, UnfitUrl> {
        let found = self.names.addresses(name).await.unwrap_or_default();
        let are_allowed = found.iter().all(|&address| self.reach.allows(address));
        match found.is_empty() || !are_allowed {
            true => Err(UnfitUrl::NotPublic(name.to_owned())),
            false => Ok(found),
        }
    }

    /// Reads a URL and checks all of it, its name too.
    pub(super) async fn check(&self, text: &str) -> Result<(), UnfitUrl> {
        let url = self.reach.check_url(text)?;
        let host = url.host_str().unwrap_or_default();
        // Where everything is allowed an endpoint may be put before its name is there.
        if literal(host).is_none() && self.reach == Reach::Public {
            self.addresses(host).await?;
        }
        Ok(())
    }
}

impl Resolve for GuardedNames {
    fn resolve(&self, name: Name) -> Resolving {
        let names = self.clone();
        Box::pin(async move {
            let found = names.addresses(name.as_str()).await?;
            // The connection takes the port of the URL.
            let addresses = found.into_iter().map(|address| SocketAddr::new(address, 0));
            Ok(Box::new(addresses) as Addrs)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPECIAL: [&str; 44] = [
        "0.0.0.0",
        "0.1.2.3",
        "10.0.0.1",
        "100.64.0.1",
        "100.127.255.255",
        "127.0.0.1",
        "127.255.0.1",
        "169.254.169.254",
        "172.16.0.1",
        "172.31.255.255",
        "192.0.0.8",
        "192.0.2.1",
        "192.88.99.1",
        "192.168.1.1",
        "198.18.0.1",
        "198.19.255.255",
        "198.51.100.7",
        "203.0.113.9",
        "224.0.0.1",
        "239.1.2.3",
        "240.0.0.1",
        "255.255.255.255",
        "::",
        "::1",
        "::7f00:1",
        "::ffff:127.0.0.1",
        "::ffff:8.8.8.8",
        "64:ff9b::8.8.8.8",
        "64:ff9b:1::1",
        "100::1",
        "2001::1",
        "2001:2::1",
        "2001:10::1",
        "2001:1ff::1",
        "2001:db8::1",
        "2002:7f00:1::",
        "3fff::1",
        "3fff:fff::1",
        "5f00::1",
        "fc00::1",
        "fdff::1",
        "fe80::1",
        "fec0::1",
        "ff02::1",
    ];

    #[test]
    fn special_addresses_are_not_public() {
        for text in SPECIAL {
            assert!(!is_public(text.parse().expect("an address")), "{text}");
        }
        let public = [
            "1.1.1.1",
            "8.8.8.8",
            "100.63.255.255",
            "100.128.0.1",
            "172.15.0.1",
            "172.32.0.1",
            "192.0.1.1",
            "192.167.1.1",
            "198.17.0.1",
            "198.20.0.1",
            "223.255.255.254",
            "2001:200::1",
            "2001:4860:4860::8888",
            "2606:4700::1111",
            "2a00:1450::1",
            "3fff:1000::1",
        ];
        for text in public {
            assert!(is_public(text.parse().expect("an address")), "{text}");
        }
    }

    #[test]
    fn urls_are_checked_however_they_are_spelled() {
        let unfit = [
            ("http://example.com/", UnfitUrl::Scheme("http".to_owned())),
            ("file:///etc/passwd", UnfitUrl::Scheme("file".to_owned())),
            ("https://user@example.com/", UnfitUrl::Credentials),
            ("https://:word@example.com/", UnfitUrl::Credentials),
            (
                "https://127.0.0.1/",
                UnfitUrl::NotPublic("127.0.0.1".to_owned()),
            ),
            (
                "https://0x7f.1:8443/",
                UnfitUrl::NotPublic("127.0.0.1".to_owned()),
            ),
            (
                "https://2130706433/",
                UnfitUrl::NotPublic("127.0.0.1".to_owned()),
            ),
            ("https://[::1]/", UnfitUrl::NotPublic("[::1]".to_owned())),
            (
                "https://[::ffff:10.0.0.1]/",
                UnfitUrl::NotPublic("[::ffff:a00:1]".to_owned()),
            ),
        ];
        for (text, why) in unfit {
            assert_eq!(Reach::Public.check_url(text), Err(why), "{text}");
        }
        let long = format!("https://example.com/{}", "a".repeat(URL_BYTES_MAX));
        assert_eq!(Reach::Public.check_url(&long), Err(UnfitUrl::TooLong));
        assert!(matches!(
            Reach::Public.check_url("/orders"),
            Err(UnfitUrl::Unreadable(_))
        ));
        for text in [
            "https://example.com/a?b=c",
            "https://example.com:8443/",
            "https://8.8.8.8/",
        ] {
            assert!(Reach::Public.check_url(text).is_ok(), "{text}");
        }
        assert!(Reach::Anywhere.check_url("http://127.0.0.1:9000/").is_ok());
        assert!(Reach::Anywhere.check_url("ftp://127.0.0.1/").is_err());
    }

    #[derive(Debug)]
    struct Fixed(&'static [&'static str]);

    impl Names for Fixed {
        fn addresses<'a>(&'a self, _: &'a str) -> Found<'a> {
            let parsed = self.0.iter().map(|text| text.parse().expect("an address"));
            let addresses: Vec<IpAddr> = parsed.collect();
            Box::pin(async move { Ok(addresses) })
        }
    }

    #[tokio::test]
    async fn one_private_address_among_several_is_enough_to_refuse_a_name() {
        let of = |names| GuardedNames {
            names: Arc::new(Fixed(names)),
            reach: Reach::Public,
        };
        assert!(
            of(&["8.8.8.8", "2606:4700::1111"])
                .addresses("a")
                .await
                .is_ok()
        );
        for names in [&["8.8.8.8", "10.0.0.1"][..], &["127.0.0.1"], &[]] {
            assert!(of(names).addresses("a").await.is_err(), "{names:?}");
            let checked = of(names).check("https://hooks.example/").await;
            assert_eq!(
                checked,
                Err(UnfitUrl::NotPublic("hooks.example".to_owned()))
            );
        }
    }
}
