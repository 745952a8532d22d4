//! The threads that talk to browsers: one accepts, one for each client.

use std::io::ErrorKind;
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket};

use crate::guard::{Claims, Guard};
use crate::hub::{Asked, Hub, MAX_CLIENTS, Reply};
use crate::wire::{self, Ask, MAX_AROUND, MAX_FILE};
use crate::{Address, ViewError, http};

/// How often a client's thread looks for something new to send.
const TICK: Duration = Duration::from_millis(3);
/// How long a client may block what is sent to it.
const SEND_PATIENCE: Duration = Duration::from_secs(10);
/// Connections served at once, clients among them.
const MAX_CONNECTIONS: usize = 32;

const PAGE: &[u8] = include_bytes!("page/index.html");
const STYLE: &[u8] = include_bytes!("page/style.css");
const SCRIPT: &[u8] = include_bytes!("page/app.js");

/// A server that listens.
pub(crate) struct Server {
    pub(crate) address: SocketAddr,
    /// What a browser is to open, the likeliest first.
    pub(crate) urls: Vec<String>,
}

/// Starts to listen; clients talk to the hub from then on.
pub(crate) fn start(wanted: Address, hub: Arc<Hub>) -> Result<Server, ViewError> {
    let asked = SocketAddr::new(wanted.ip, wanted.port);
    let listener = TcpListener::bind(asked).map_err(|error| ViewError::cannot_listen(asked, &error))?;
    let address = listener.local_addr().map_err(|error| ViewError::cannot_listen(asked, &error))?;
    let token = if address.ip().is_loopback() { None } else { Some(random_token()?) };
    let query = token.as_ref().map_or_else(String::new, |token| format!("?token={token}"));
    let urls = names_of(address).into_iter().map(|name| format!("http://{name}/{query}")).collect();
    let guard = Guard::new(address, token);
    std::thread::Builder::new()
        .name("viewer".into())
        .spawn(move || accept(&listener, &guard, &hub))
        .map_err(|error| ViewError::cannot_listen(asked, &error))?;
    Ok(Server { address, urls })
}

/// What others call an address: itself; or for all interfaces of a machine, the interface that leads out, the name of the
/// machine, and what it calls itself.
fn names_of(address: SocketAddr) -> Vec<String> {
    if !address.ip().is_unspecified() {
        return vec![address.to_string()];
    }
    let port = address.port();
    let mut names: Vec<String> =
        outward(address.is_ipv6()).map(|ip| SocketAddr::new(ip, port).to_string()).into_iter().collect();
    names.extend(machine_name().map(|name| format!("{name}:{port}")));
    names.push(format!("127.0.0.1:{port}"));
    if address.is_ipv6() {
        names.push(format!("[::1]:{port}"));
    }
    names
}

/// The address of the interface that leads out. Nothing is sent: to connect a datagram socket only chooses the interface.
fn outward(v6: bool) -> Option<IpAddr> {
    let towards = |from: &str, to: &str| {
        let socket = UdpSocket::bind(from).ok()?;
        socket.connect(to).ok()?;
        Some(socket.local_addr().ok()?.ip()).filter(|ip| !ip.is_unspecified() && !ip.is_loopback())
    };
    // Addresses that are set aside for documentation.
    let four = || towards("0.0.0.0:0", "192.0.2.1:9");
    if v6 { towards("[::]:0", "[2001:db8::1]:9").or_else(four) } else { four() }
}

/// What the machine is called, if that is a name that can stand in an address.
fn machine_name() -> Option<String> {
    let said = std::fs::read_to_string("/etc/hostname").ok().or_else(|| std::env::var("HOSTNAME").ok())?;
    let name = said.trim();
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '.';
    (!name.is_empty() && name.len() <= 253 && name.chars().all(fits)).then(|| name.to_string())
}

/// 128 random bits in hexadecimal digits.
fn random_token() -> Result<String, ViewError> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes)
        .map_err(|error| ViewError::Failed(format!("there are no random numbers: {error}")))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

fn accept(listener: &TcpListener, guard: &Guard, hub: &Arc<Hub>) {
    let connections = Arc::new(AtomicUsize::new(0));
    for stream in listener.incoming() {
        if hub.is_stopped() {
            return;
        }
        let Ok(stream) = stream else {
            std::thread::sleep(TICK);
            continue;
        };
        // Who comes when all places are taken waits in line: places are given back soon, since a head
        // that does not arrive is not waited for long, and clients are fewer than places.
        while connections.load(Ordering::Acquire) >= MAX_CONNECTIONS {
            if hub.is_stopped() {
                return;
            }
            std::thread::sleep(TICK);
        }
        connections.fetch_add(1, Ordering::AcqRel);
        let (guard, hub, count) = (guard.clone(), Arc::clone(hub), Arc::clone(&connections));
        let work = move || {
            serve(stream, &guard, &hub);
            count.fetch_sub(1, Ordering::AcqRel);
        };
        if std::thread::Builder::new().name("viewer client".into()).spawn(work).is_err() {
            connections.fetch_sub(1, Ordering::AcqRel);
        }
    }
}

fn serve(mut stream: TcpStream, guard: &Guard, hub: &Hub) {
    let _ = (stream.set_nodelay(true), stream.set_write_timeout(Some(SEND_PATIENCE)));
    let Some(head) = http::read_head(&mut stream) else { return };
    let claims = Claims { host: head.host.as_deref(), origin: head.origin.as_deref(), query: &head.query };
    let text = "text/plain; charset=utf-8";
    // Style and script hold no secret, and the page names them without its token.
    let open = matches!(head.path.as_str(), "/style.css" | "/app.js");
    if let Err(reason) = guard.admit(claims)
        && !(open && reason.contains("token"))
    {
        return http::answer(&mut stream, "403 Forbidden", text, reason.as_bytes());
    }
    match head.path.as_str() {
        "/" => http::answer(&mut stream, "200 OK", "text/html; charset=utf-8", PAGE),
        "/style.css" => http::answer(&mut stream, "200 OK", "text/css; charset=utf-8", STYLE),
        "/app.js" => http::answer(&mut stream, "200 OK", "text/javascript; charset=utf-8", SCRIPT),
        "/socket" if head.origin.is_none() => {
            http::answer(&mut stream, "403 Forbidden", text, b"a socket is opened by the page");
        }
        "/socket" => {
            let Some(client) = hub.join() else {
                let reason = format!("{MAX_CLIENTS} windows look already");
                return http::answer(&mut stream, "503 Service Unavailable", text, reason.as_bytes());
            };
            if head.upgrade(&mut stream) {
                talk(stream, hub, client);
            } else {
                http::answer(&mut stream, "400 Bad Request", text, b"this is for WebSockets");
            }
            hub.leave(client);
        }
        _ => http::answer(&mut stream, "404 Not Found", text, b"there is nothing here"),
    }
}

/// Reads and sends until the client goes.
fn talk(stream: TcpStream, hub: &Hub, client: u64) {
    if stream.set_read_timeout(Some(TICK)).is_err() {
        return;
    }
    let limit = MAX_FILE + MAX_AROUND;
    let config = WebSocketConfig::default().max_message_size(Some(limit)).max_frame_size(Some(limit));
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, Some(config));
    let mut seen = [0; 4];
    let mut told = None;
    while !hub.is_stopped() {
        match socket.read() {
            Ok(Message::Text(text)) => take_text(hub, client, text.as_str()),
            Ok(Message::Binary(bytes)) => take_files(hub, client, &bytes),
            Ok(Message::Close(_)) => return,
            Ok(_) => {}
            Err(tungstenite::Error::Io(error))
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(_) => return,
        }
        if send_news(&mut socket, hub, client, &mut seen, &mut told).is_err() {
            return;
        }
    }
    let _ = socket.close(None);
}

fn take_text(hub: &Hub, client: u64, text: &str) {
    let outcome = wire::parse(text).and_then(|ask| {
        if ask == (Ask::Control {}) {
            hub.take_controls(client);
            return Ok(());
        }
        if !ask.only_looks() && !hub.has_controls(client) {
            return Err("another window has the controls".into());
        }
        if hub.ask(client, Asked::Ask(ask)) { Ok(()) } else { Err("too much was asked at once".into()) }
    });
    if let Err(reason) = outcome {
        hub.reply(client, Reply::Text(error(&reason)));
    }
}

/// Files that were dropped on the page.
fn take_files(hub: &Hub, client: u64, bytes: &[u8]) {
    let outcome = (|| {
        if !hub.has_controls(client) {
            return Err("another window has the controls".to_string());
        }
        let (header, files) = wire::unpack(bytes)?;
        let asked = Asked::Files { files, reference: header.reference };
        if hub.ask(client, asked) { Ok(()) } else { Err("too much was asked at once".into()) }
    })();
    if let Err(reason) = outcome {
        hub.reply(client, Reply::Text(error(&reason)));
    }
}

/// An error as the page shows it.
pub(crate) fn error(reason: &str) -> String {
    serde_json::json!({ "kind": "error", "text": reason }).to_string()
}

fn send_news(
    socket: &mut WebSocket<TcpStream>,
    hub: &Hub,
    client: u64,
    seen: &mut [u64; 4],
    told: &mut Option<(bool, usize)>,
) -> Result<(), tungstenite::Error> {
    let (controls, windows) = (hub.has_controls(client), hub.clients());
    if *told != Some((controls, windows)) {
        *told = Some((controls, windows));
        let text = serde_json::json!({ "kind": "controls", "yours": controls, "windows": windows });
        socket.send(Message::text(text.to_string()))?;
    }
    if let Some(state) = hub.state.after(&mut seen[3], Duration::ZERO) {
        socket.send(Message::text(state.as_str()))?;
    }
    for (pictures, seen) in hub.pictures.iter().zip(seen) {
        if let Some(picture) = pictures.after(seen, Duration::ZERO) {
            socket.send(Message::binary(picture.as_slice().to_vec()))?;
        }
    }
    for reply in hub.replies_for(client) {
        socket.send(match reply {
            Reply::Text(text) => Message::text(text),
            Reply::Bytes(bytes) => Message::binary(bytes),
        })?;
    }
    Ok(())
}
