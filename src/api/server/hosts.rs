//! The names under which an edge without tokens answers, so that no web page reaches it by DNS rebinding.

use http::header::{HOST, ORIGIN};
use http::request::Parts;
use std::net::SocketAddr;

/// The loopback names of a listener, with its port.
#[derive(Debug)]
pub(crate) struct Hosts {
    names: Vec<String>,
}

impl Hosts {
    pub(crate) fn of(address: SocketAddr) -> Self {
        const HTTP_PORT: u16 = 80;
        let port = address.port();
        let own = address.to_string();
        let mut names = vec![
            format!("127.0.0.1:{port}"),
            format!("localhost:{port}"),
            format!("[::1]:{port}"),
        ];
        if !names.contains(&own) {
            names.push(own);
        }
        if port == HTTP_PORT {
            let without_port: Vec<String> =
                names.iter().map(|name| name.replace(":80", "")).collect();
            names.extend(without_port);
        }
        Self { names }
    }

    /// What of a request names another host, for people; none where nothing does.
    pub(crate) fn stranger(&self, head: &Parts) -> Option<&'static str> {
        let authority = head.uri.authority().map(http::uri::Authority::as_str);
        if authority.is_some_and(|name| !self.has(name.as_bytes())) {
            return Some("the authority is not this server");
        }
        let mut hosts = head.headers.get_all(HOST).iter();
        match (hosts.next(), hosts.next()) {
            (None, None) if authority.is_some() => {}
            (Some(host), None) if self.has(host.as_bytes()) => {}
            (Some(_), None) => return Some("the Host header is not this server"),
            (None, _) => return Some("there is no Host header"),
            (Some(_), Some(_)) => return Some("there are several Host headers"),
        }
        let is_own = |origin: &[u8]| {
            origin
                .strip_prefix(b"http://")
                .is_some_and(|name| self.has(name))
        };
        let mut origins = head.headers.get_all(ORIGIN).iter();
        if origins.any(|origin| !is_own(origin.as_bytes())) {
            return Some("the Origin header is not this server");
        }
        None
    }

    fn has(&self, name: &[u8]) -> bool {
        self.names
            .iter()
            .any(|own| own.as_bytes().eq_ignore_ascii_case(name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use http::Request;

    fn stranger(uri: &str, headers: &[(&str, &str)]) -> Option<&'static str> {
        let hosts = Hosts::of("127.0.0.1:8080".parse().expect("an address"));
        let mut request = Request::builder().uri(uri);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        hosts.stranger(&request.body(()).expect("a request").into_parts().0)
    }

    #[test]
    fn only_loopback_names_with_the_port_are_answered() {
        for own in [
            "127.0.0.1:8080",
            "localhost:8080",
            "LocalHost:8080",
            "[::1]:8080",
        ] {
            assert_eq!(stranger("/", &[("host", own)]), None, "{own}");
            let origin = format!("http://{own}");
            assert_eq!(
                stranger("/", &[("host", own), ("origin", &origin)]),
                None,
                "{own}"
            );
            assert_eq!(stranger(&format!("http://{own}/"), &[]), None, "{own}");
        }
        for other in [
            "evil.example",
            "evil.example:8080",
            "localhost",
            "localhost:81",
            "localhost:8080.evil.example",
            "",
        ] {
            assert!(stranger("/", &[("host", other)]).is_some(), "{other}");
        }
        let own = ("host", "localhost:8080");
        for origin in [
            "null",
            "http://evil.example",
            "https://localhost:8080",
            "http://localhost:8081",
            "localhost:8080",
        ] {
            assert!(
                stranger("/", &[own, ("origin", origin)]).is_some(),
                "{origin}"
            );
        }
        assert!(stranger("/", &[]).is_some());
        assert!(stranger("/", &[own, own]).is_some());
        assert!(stranger("http://evil.example:8080/", &[own]).is_some());
    }

    #[test]
    fn the_port_of_http_may_be_left_out() {
        let hosts = Hosts::of("127.0.0.1:80".parse().expect("an address"));
        assert!(hosts.has(b"localhost"));
        assert!(hosts.has(b"localhost:80"));
        assert!(!hosts.has(b"localhost:8080"));
    }
}
