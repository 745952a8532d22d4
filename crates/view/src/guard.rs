//! Who may talk to the viewer.
//!
//! A page of another site can make a browser send requests here. It cannot choose the `Host` of a connection to a
//! name of its own (which a rebinding name server points here), nor the `Origin` that the browser adds: both are
//! checked. Beyond the loopback interface, where a machine goes by names that it does not know itself, any host is taken
//! that comes with the random token of the address, which no other site knows.

use std::net::{IpAddr, SocketAddr};

/// The rules of one server.
#[derive(Clone, Debug)]
pub(crate) struct Guard {
    address: SocketAddr,
    token: Option<String>,
}

/// What a request says about where it comes from.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Claims<'a> {
    pub(crate) host: Option<&'a str>,
    pub(crate) origin: Option<&'a str>,
    /// What follows the question mark.
    pub(crate) query: &'a str,
}

impl Guard {
    pub(crate) fn new(address: SocketAddr, token: Option<String>) -> Self {
        Self { address, token }
    }

    /// Whether the request may be answered; else why not.
    pub(crate) fn admit(&self, claims: Claims<'_>) -> Result<(), &'static str> {
        let host = claims.host.ok_or("the request names no host")?;
        if !self.is_me(host) {
            return Err("the request is for another host");
        }
        if let Some(origin) = claims.origin {
            let site = origin.strip_prefix("http://").ok_or("the request comes from another site")?;
            if site != host {
                return Err("the request comes from another site");
            }
        }
        match &self.token {
            Some(token) if !has_token(claims.query, token) => Err("the address lacks its token"),
            _ => Ok(()),
        }
    }

    /// Whether a host's name may stand for this server: on the loopback interface its usual names, elsewhere any (a name
    /// could be pointed here by somebody else, who does not know the token).
    fn is_me(&self, host: &str) -> bool {
        if !self.address.ip().is_loopback() {
            return true;
        }
        let (name, port) = match host.rsplit_once(':') {
            Some((name, port)) if !port.contains(']') => (name, port),
            _ => (host, "80"),
        };
        if port.parse() != Ok(self.address.port()) {
            return false;
        }
        let bare = name.trim_start_matches('[').trim_end_matches(']');
        let number = bare.parse::<IpAddr>();
        name.eq_ignore_ascii_case("localhost") || number.is_ok_and(|ip| ip.is_loopback())
    }
}

/// Compares all of the token, whatever differs first.
fn has_token(query: &str, token: &str) -> bool {
    query.split('&').filter_map(|pair| pair.strip_prefix("token=")).any(|given| {
        let differing = given.bytes().zip(token.bytes()).fold(0, |sum, (a, b)| sum | (a ^ b));
        differing == 0 && given.len() == token.len()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loopback() -> Guard {
        Guard::new("127.0.0.1:8000".parse().unwrap(), None)
    }

    fn from<'a>(host: &'a str, origin: Option<&'a str>) -> Claims<'a> {
        Claims { host: Some(host), origin, query: "" }
    }

    #[test]
    fn the_page_itself_is_admitted_by_all_names_of_the_loopback_interface() {
        for host in ["127.0.0.1:8000", "localhost:8000", "[::1]:8000"] {
            let origin = format!("http://{host}");
            assert_eq!(loopback().admit(from(host, Some(&origin))), Ok(()));
            assert_eq!(loopback().admit(from(host, None)), Ok(()));
        }
    }

    #[test]
    fn foreign_pages_and_rebound_names_are_refused() {
        let guard = loopback();
        assert!(guard.admit(from("127.0.0.1:8000", Some("http://evil.example"))).is_err());
        assert!(guard.admit(from("127.0.0.1:8000", Some("https://127.0.0.1:8000"))).is_err());
        assert!(guard.admit(from("127.0.0.1:8000", Some("http://localhost:3000"))).is_err());
        assert!(guard.admit(from("127.0.0.1:8000", Some("null"))).is_err());
        assert!(guard.admit(from("evil.example:8000", None)).is_err());
        assert!(guard.admit(from("192.168.0.7:8000", None)).is_err());
        assert!(guard.admit(from("127.0.0.1:8001", None)).is_err());
        assert!(guard.admit(Claims::default()).is_err());
    }

    #[test]
    fn beyond_the_loopback_interface_the_token_is_asked_for() {
        let guard = Guard::new("0.0.0.0:8000".parse().unwrap(), Some("abc123".into()));
        let with = |query| Claims { host: Some("192.168.0.7:8000"), origin: None, query };
        assert_eq!(guard.admit(with("token=abc123")), Ok(()));
        assert_eq!(guard.admit(with("x=1&token=abc123")), Ok(()));
        for wrong in ["", "token=", "token=abc12", "token=abc1234", "token=abc124", "tok=abc123"] {
            assert!(guard.admit(with(wrong)).is_err(), "{wrong}");
        }
        // By whatever name it is reached, the token decides; and a page of another site is not this page.
        let named = |query| Claims { host: Some("studio.local:8000"), ..with(query) };
        assert_eq!(guard.admit(named("token=abc123")), Ok(()));
        assert!(guard.admit(named("")).is_err());
        let origin = Some("http://evil.example");
        assert!(guard.admit(Claims { origin, ..named("token=abc123") }).is_err());
    }
}
