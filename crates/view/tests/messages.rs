//! A server with a client that says anything: nothing breaks, nothing grows, and what it may not do it cannot.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use halflight_image::RgbImage;
use halflight_scene::{LoadOptions, Scene};
use halflight_view::{Address, Kept, Library, Stage, Swap, ViewError, view};
use serde_json::Value;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

const SCENE: &str = "
    environment = \"studio\"
    [image]
    size = [24, 16]
    [camera]
    origin = [0, 1, 4]
    target = [0, 0, 0]
    [[shape]]
    name = \"ball\"
    type = \"sphere\"
    keyframes = [{ time = 0, translate = [0, 0, 0] }, { time = 1, translate = [1, 0, 0] }]
";

struct One;

fn stage(text: &str) -> Result<Stage, String> {
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).map_err(|error| error.to_string())?;
    let scene = Scene::load(&path, &LoadOptions::default()).map_err(|error| error.to_string())?;
    Ok(Stage { name: "one".into(), scene, settings: Vec::new() })
}

impl Library for One {
    fn names(&self) -> Vec<String> {
        vec!["one".into()]
    }
    fn environments(&self) -> Vec<String> {
        Vec::new()
    }
    fn open(&mut self, name: &str, _: &Swap) -> Result<Stage, String> {
        if name == "one" { stage(SCENE) } else { Err(format!("there is no {name}")) }
    }
    fn take(&mut self, files: &[(String, Vec<u8>)]) -> Result<Stage, String> {
        stage(std::str::from_utf8(&files[0].1).map_err(|error| error.to_string())?)
    }
    fn pictures(&self) -> Vec<String> {
        vec!["stored".into()]
    }
    fn picture(&mut self, name: &str) -> Result<RgbImage, String> {
        if name == "stored" {
            Ok(RgbImage::from_fn(24, 16, |_, _| [0.25; 3]))
        } else {
            Err("there is none".into())
        }
    }
    fn take_picture(&mut self, _: &str, _: &[u8]) -> Result<RgbImage, String> {
        Err("this is no picture".into())
    }
    fn keep(&mut self, _: &Kept) -> Result<String, String> {
        Ok("nowhere".into())
    }
}

struct Running {
    address: SocketAddr,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<(), ViewError>>>,
}

impl Running {
    fn start() -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let (tell, told) = mpsc::channel();
        let until = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let address = Address { ip: [127, 0, 0, 1].into(), port: 0 };
            let ready = |_: &[String], address: SocketAddr| tell.send(address).expect("the test waits");
            let over = || until.load(Ordering::Relaxed);
            view(address, Box::new(One), stage(SCENE).expect("the scene is sound"), "path", ready, &over)
        });
        let address = told.recv_timeout(Duration::from_secs(60)).expect("the server starts");
        Self { address, stop, thread: Some(thread) }
    }

    fn join(&self) -> WebSocket<TcpStream> {
        let stream = TcpStream::connect(self.address).expect("the server listens");
        stream.set_read_timeout(Some(Duration::from_millis(2))).expect("a timeout is set");
        let mut request = format!("ws://{}/socket", self.address).into_client_request().expect("an address");
        let origin = format!("http://{}", self.address).parse().expect("a header");
        request.headers_mut().insert("Origin", origin);
        // The handshake's answer may take longer than the timeout of reads.
        stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a timeout is set");
        let (socket, _) = tungstenite::client(request, stream).expect("the server shakes hands");
        socket.get_ref().set_read_timeout(Some(Duration::from_millis(2))).expect("a timeout is set");
        socket
    }

    fn get(&self, head: &str) -> String {
        let mut stream = TcpStream::connect(self.address).expect("the server listens");
        stream.write_all(head.as_bytes()).expect("it reads");
        let mut said = String::new();
        let _ = stream.read_to_string(&mut said);
        said
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let ended = self.thread.take().map(JoinHandle::join);
        if !std::thread::panicking() {
            assert!(matches!(ended, Some(Ok(Ok(())))), "the server ended well");
        }
    }
}

/// A text that arrives within some seconds and holds all of these.
fn hear(socket: &mut WebSocket<TcpStream>, words: &[&str]) -> String {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(60) {
        if let Ok(Message::Text(text)) = socket.read()
            && words.iter().all(|word| text.contains(word))
        {
            return text.to_string();
        }
    }
    panic!("nothing was said of {words:?}");
}

/// Kilobytes that this process holds.
fn resident() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// A sequence of numbers that looks random.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }
    fn float(&mut self) -> f64 {
        let wide = [0.0, 1.0, -1.0, 0.3, 1e-3, 1e9, -1e30, 1e300];
        wide[self.next() as usize % wide.len()] * (self.next() as f64 / 2f64.powi(31))
    }
}

fn anything(numbers: &mut Numbers) -> Message {
    let (a, b) = (numbers.float(), numbers.float());
    let text = match numbers.next() % 27 {
        0 => format!(r#"{{"do":"orbit","x":{a},"y":{b}}}"#),
        1 => format!(r#"{{"do":"pan","x":{a},"y":{b}}}"#),
        2 => format!(r#"{{"do":"look","x":{a},"y":{b}}}"#),
        3 => format!(r#"{{"do":"dolly","by":{a}}}"#),
        4 => format!(r#"{{"do":"fly","by":[{a},{b},{a}]}}"#),
        5 => format!(r#"{{"do":"field-of-view","degrees":{a}}}"#),
        6 => format!(r#"{{"do":"aperture","radius":{a}}}"#),
        7 => format!(r#"{{"do":"focus","x":{a},"y":{b}}}"#),
        8 => format!(r#"{{"do":"time","seconds":{a}}}"#),
        9 => format!(r#"{{"do":"environment","degrees":{a}}}"#),
        10 => format!(r#"{{"do":"move","object":"ball","by":[{a},{b},0]}}"#),
        11 => format!(r#"{{"do":"exposure","ev":{a}}}"#),
        12 => format!(r#"{{"do":"explain","x":{a},"y":{b}}}"#),
        13 => r#"{"do":"frame"}"#.into(),
        14 => r#"{"do":"home"}"#.into(),
        15 => r#"{"do":"save","format":"tiff"}"#.into(),
        16 => r#"{"do":"open","name":"../../etc/passwd"}"#.into(),
        17 => r#"{"do":"layer","name":"normal"}"#.into(),
        18 => r#"{"do":"layer","name":"color"}"#.into(),
        19 => r#"{"do":"set","side":"a","key":"max_depth","value":"zzz"}"#.into(),
        20 => "{".repeat(numbers.next() as usize % 40_000),
        21 => (0..numbers.next() % 200)
            .map(|_| char::from_u32(numbers.next() as u32 % 0x2000).unwrap_or('x'))
            .collect(),
        22 => {
            return Message::binary(
                (0..numbers.next() % 300).map(|_| numbers.next() as u8).collect::<Vec<u8>>(),
            );
        }
        23 => r#"{"do":"reference","name":"stored"}"#.into(),
        24 => r#"{"do":"compare","on":false}"#.into(),
        25 => r#"{"do":"material","object":"ball","material":"copper"}"#.into(),
        _ => format!(
            r#"{{"do":"size","width":{},"height":{}}}"#,
            8 + numbers.next() % 40,
            8 + numbers.next() % 30
        ),
    };
    Message::text(text)
}

#[test]
fn twenty_thousand_random_messages_leave_memory_flat_and_the_server_well() {
    let running = Running::start();
    let mut socket = running.join();
    hear(&mut socket, &["\"kind\":\"state\""]);
    let mut numbers = Numbers(1);
    let mut before = None;
    for number in 0..20_000 {
        if number == 4_000 {
            before = resident();
        }
        socket.send(anything(&mut numbers)).expect("the server reads on");
        if number % 20 == 0 {
            while socket.read().is_ok() {}
        }
    }
    // It may still have its hands full, and says so; then it answers.
    let begun = Instant::now();
    loop {
        assert!(begun.elapsed() < Duration::from_secs(60), "the server answers after all");
        socket.send(Message::text(r#"{"do":"keep"}"#)).expect("the server reads on");
        let asked = Instant::now();
        let mut is_kept = false;
        while !is_kept && asked.elapsed() < Duration::from_secs(2) {
            is_kept = matches!(socket.read(), Ok(Message::Text(text)) if text.contains("\"kept\""));
        }
        if is_kept {
            break;
        }
    }
    if let (Some(before), Some(after)) = (before, resident()) {
        assert!(after < before + 64 * 1024, "{before} KB became {after} KB");
    }
}

#[test]
fn a_foreign_page_is_turned_away() {
    let running = Running::start();
    let address = running.address;
    let page = running.get(&format!("GET / HTTP/1.1\r\nHost: {address}\r\n\r\n"));
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("<canvas"), "{page:.100}");
    for head in [
        "GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n".to_string(),
        format!("GET / HTTP/1.1\r\nHost: {address}\r\nOrigin: http://evil.example\r\n\r\n"),
        format!(
            "GET /socket HTTP/1.1\r\nHost: {address}\r\nOrigin: http://evil.example\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        ),
        format!(
            "GET /socket HTTP/1.1\r\nHost: {address}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        ),
    ] {
        assert!(running.get(&head).starts_with("HTTP/1.1 403"), "{head}");
    }
    assert!(
        running.get(&format!("GET /nothing HTTP/1.1\r\nHost: {address}\r\n\r\n")).starts_with("HTTP/1.1 404")
    );
}

#[test]
fn clients_that_vanish_or_say_nothing_do_no_harm() {
    let running = Running::start();
    for _ in 0..20 {
        drop(TcpStream::connect(running.address));
        let mut half = TcpStream::connect(running.address).expect("the server listens");
        half.write_all(b"GET / HT").expect("it reads");
    }
    for _ in 0..12 {
        let mut socket = running.join();
        socket.send(Message::text(r#"{"do":"orbit","x":0.1,"y":0}"#)).expect("it reads");
        // No farewell; the server hears of it within a moment.
        drop(socket);
        std::thread::sleep(Duration::from_millis(100));
    }
    let begun = Instant::now();
    let mut socket = running.join();
    hear(&mut socket, &["\"yours\":true"]);
    hear(&mut socket, &["\"kind\":\"state\""]);
    assert!(begun.elapsed() < Duration::from_secs(30));
}

#[test]
fn one_window_has_the_controls_and_another_may_take_them() {
    let running = Running::start();
    let (mut first, mut second) = (running.join(), running.join());
    hear(&mut first, &["\"yours\":true"]);
    hear(&mut second, &["\"yours\":false"]);
    second.send(Message::text(r#"{"do":"home"}"#)).expect("it reads");
    hear(&mut second, &["another window has the controls"]);
    second.send(Message::text(r#"{"do":"explain","x":0.5,"y":0.5}"#)).expect("it reads");
    assert!(hear(&mut second, &["\"explain\""]).contains("ball"));
    second.send(Message::text(r#"{"do":"control"}"#)).expect("it reads");
    hear(&mut second, &["\"yours\":true"]);
    hear(&mut first, &["\"yours\":false"]);
}

/// A picture's header within some seconds that is as wanted.
fn see(socket: &mut WebSocket<TcpStream>, wanted: impl Fn(&Value) -> bool) -> Value {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(60) {
        let Ok(Message::Binary(bytes)) = socket.read() else { continue };
        let length = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as usize;
        let header: Value = serde_json::from_slice(&bytes[4..4 + length]).expect("a header");
        if wanted(&header) {
            return header;
        }
    }
    panic!("there was no such picture");
}

#[test]
fn a_stored_picture_is_compared_with() {
    let running = Running::start();
    let mut socket = running.join();
    socket.send(Message::text(r#"{"do":"reference","name":"nothing"}"#)).expect("it reads");
    hear(&mut socket, &["there is none"]);
    socket.send(Message::text(r#"{"do":"reference","name":"stored"}"#)).expect("it reads");
    see(&mut socket, |header| header["side"] == "b" && header["technique"] == "stored");
    hear(&mut socket, &["\"relative_mse\":", "\"flip\":0.", "\"reference\":\"stored\""]);
    socket.send(Message::text(r#"{"do":"layer","name":"flip"}"#)).expect("it reads");
    let map = see(&mut socket, |header| header["side"] == "map");
    assert_eq!(map["legend"]["map"], "magma");
    socket.send(Message::text(r#"{"do":"explain","x":0.5,"y":0.5,"side":"b"}"#)).expect("it reads");
    assert!(hear(&mut socket, &["\"explain\""]).contains("radiance (0.2500, 0.2500, 0.2500)"));
}

#[test]
fn a_question_while_the_picture_gets_better_is_answered_with_radiance() {
    let running = Running::start();
    let mut socket = running.join();
    hear(&mut socket, &["\"kind\":\"state\""]);
    for step in 0..20 {
        if step % 4 == 0 {
            socket.send(Message::text(r#"{"do":"orbit","x":0.01,"y":0}"#)).expect("it reads");
        }
        socket.send(Message::text(r#"{"do":"explain","x":0.5,"y":0.5}"#)).expect("it reads");
        let said = hear(&mut socket, &["\"explain\""]);
        assert!(said.contains("radiance (") && !said.contains("\\n0 samples"), "{said}");
    }
}

#[test]
fn a_file_is_of_the_whole_size_even_while_something_moves() {
    let running = Running::start();
    let mut socket = running.join();
    socket.send(Message::text(r#"{"do":"size","width":400,"height":300}"#)).expect("it reads");
    socket.send(Message::text(r#"{"do":"orbit","x":0.1,"y":0}"#)).expect("it reads");
    socket.send(Message::text(r#"{"do":"save","format":"exr"}"#)).expect("it reads");
    let begun = Instant::now();
    let bytes = loop {
        assert!(begun.elapsed() < Duration::from_secs(60), "a file arrives");
        let Ok(Message::Binary(bytes)) = socket.read() else { continue };
        let length = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as usize;
        let header: Value = serde_json::from_slice(&bytes[4..4 + length]).expect("a header");
        if header["kind"] == "file" {
            break bytes[4 + length..].to_vec();
        }
    };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("saved.exr");
    std::fs::write(&path, bytes).expect("a file");
    let picture = halflight_image::Picture::load_exr(&path).expect("a picture");
    assert_eq!((picture.width, picture.height), (400, 300));
    let said = |key: &str| picture.metadata.get(key).map_or("", String::as_str);
    assert!(said("version").starts_with("halflight ") && said("camera").contains("up=[0, 1, 0]"));
    assert!(said("technique").contains("max_depth") && said("light_turn_degrees") == "0");
}

#[test]
fn all_windows_hear_how_many_look() {
    let running = Running::start();
    let mut first = running.join();
    hear(&mut first, &["\"windows\":1"]);
    let second = running.join();
    hear(&mut first, &["\"windows\":2"]);
    drop(second);
    hear(&mut first, &["\"windows\":1"]);
}

#[test]
fn a_port_in_use_is_told_with_what_to_do() {
    let running = Running::start();
    let address = Address { ip: [127, 0, 0, 1].into(), port: running.address.port() };
    let error = view(address, Box::new(One), stage(SCENE).expect("sound"), "path", |_, _| (), &|| true);
    assert!(error.expect_err("the port is in use").to_string().contains("--port"));
}
