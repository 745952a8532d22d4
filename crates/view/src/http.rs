//! The little of HTTP that a page and its socket need: the head of a request is read within bounds of size and time, and
//! answered by what is built in or by the change to a WebSocket.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use tungstenite::handshake::server::{Request, create_response};
use tungstenite::http::{HeaderName, HeaderValue, Method};

/// Bytes of a head at most.
const MAX_HEAD: usize = 16 * 1024;
/// Headers of a request at most.
const MAX_HEADERS: usize = 64;
/// How long a client may take for its head.
const PATIENCE: Duration = Duration::from_secs(5);

/// A request that was read.
pub(crate) struct Head {
    pub(crate) path: String,
    pub(crate) query: String,
    pub(crate) host: Option<String>,
    pub(crate) origin: Option<String>,
    /// For the change to a WebSocket.
    request: Request,
}

/// Reads the head of a request; `None` if there is none that could be answered.
pub(crate) fn read_head(stream: &mut TcpStream) -> Option<Head> {
    let begun = Instant::now();
    let mut bytes = Vec::new();
    let mut chunk = [0; 2048];
    stream.set_read_timeout(Some(Duration::from_millis(500))).ok()?;
    while bytes.len() <= MAX_HEAD && begun.elapsed() < PATIENCE {
        match stream.read(&mut chunk) {
            Ok(0) => return None,
            Ok(count) => bytes.extend_from_slice(&chunk[..count]),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => continue,
            Err(_) => return None,
        }
        if bytes.windows(4).any(|end| end == b"\r\n\r\n") {
            return parse(&bytes);
        }
    }
    None
}

/// A head from its bytes.
pub(crate) fn parse(bytes: &[u8]) -> Option<Head> {
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    if !parsed.parse(bytes).ok()?.is_complete() || parsed.method != Some("GET") {
        return None;
    }
    let target = parsed.path?;
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let mut request = Request::new(());
    *request.method_mut() = Method::GET;
    *request.uri_mut() = target.parse().ok()?;
    for header in parsed.headers.iter() {
        let name = HeaderName::from_bytes(header.name.as_bytes()).ok()?;
        request.headers_mut().append(name, HeaderValue::from_bytes(header.value).ok()?);
    }
    let one = |name: &str| {
        let mut all = request.headers().get_all(name).iter();
        let first = all.next()?.to_str().ok()?.to_string();
        // Two hosts are as good as none.
        all.next().is_none().then_some(first)
    };
    let (host, origin) = (one("host"), one("origin"));
    // An origin that cannot be read is not one that may be left out.
    let origin =
        if request.headers().contains_key("origin") { Some(origin.unwrap_or_default()) } else { None };
    Some(Head { path: path.into(), query: query.into(), host, origin, request })
}

impl Head {
    /// Changes the connection to a WebSocket; false if the request does not ask for that.
    pub(crate) fn upgrade(&self, stream: &mut TcpStream) -> bool {
        let Ok(response) = create_response(&self.request) else { return false };
        let mut text = String::from("HTTP/1.1 101 Switching Protocols\r\n");
        for (name, value) in response.headers() {
            text.push_str(&format!("{name}: {}\r\n", value.to_str().unwrap_or_default()));
        }
        text.push_str("\r\n");
        stream.write_all(text.as_bytes()).is_ok()
    }
}

/// Sends an answer and ends the connection.
pub(crate) fn answer(stream: &mut TcpStream, status: &str, kind: &str, body: &[u8]) {
    // Nothing is loaded from elsewhere, and nobody else may show the page within his own.
    let head = format!(
        "HTTP/1.1 {status}\r\ncontent-type: {kind}\r\ncontent-length: {}\r\ncache-control: no-store\r\n\
         content-security-policy: default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; \
         frame-ancestors 'none'\r\nx-content-type-options: nosniff\r\nreferrer-policy: no-referrer\r\nconnection: close\r\n\r\n",
        body.len()
    );
    let _ =
        stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(body)).and_then(|()| stream.flush());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_head_is_taken_apart() {
        let head =
            parse(b"GET /socket?token=x HTTP/1.1\r\nHost: localhost:1\r\nOrigin: http://localhost:1\r\n\r\n")
                .unwrap();
        assert_eq!((head.path.as_str(), head.query.as_str()), ("/socket", "token=x"));
        assert_eq!(
            (head.host.as_deref(), head.origin.as_deref()),
            (Some("localhost:1"), Some("http://localhost:1"))
        );
    }

    #[test]
    fn what_is_no_plain_request_is_refused() {
        for bytes in [
            &b""[..],
            b"POST / HTTP/1.1\r\nHost: a\r\n\r\n",
            b"GET / HTTP/1.1\r\nHost: a",
            b"\x00\xff\x00\r\n\r\n",
            b"GET\r\n\r\n",
        ] {
            assert!(parse(bytes).is_none());
        }
        let two = parse(b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\nOrigin: x\r\nOrigin: y\r\n\r\n").unwrap();
        assert_eq!((two.host, two.origin.as_deref()), (None, Some("")));
        let strange = parse(b"GET / HTTP/1.1\r\nHost: a\r\nOrigin: \xff\r\n\r\n").unwrap();
        assert_eq!(strange.origin.as_deref(), Some(""));
    }
}
