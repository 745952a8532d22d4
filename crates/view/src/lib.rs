//! The live viewer: serves a page, streams pictures to it, and does what the person at it asks for.
//!
//! [`view`] listens on an address, renders on the calling thread, and ends when it is told to. What it shows comes from a
//! [`Library`]: scenes by name, loaded by whoever calls.
//!
//! | file | what it does |
//! |---|---|
//! | `guard`, `http`, `server` | who may come in, the page, the sockets |
//! | `wire`, `hub`, `newest` | what is said; wishes in, pictures out, nothing queued |
//! | `eye` | the camera in a person's hands |
//! | `studio`, `side`, `job` | what becomes of wishes; what is rendered when, each picture on a thread of its own |
//! | `compare`, `answers` | how the sides differ; why a pixel is as it is, and files to save |
//! | `pictures` | from films to bytes |
//! | `page/` | HTML, style and script, built into the program |
//!
//! Pictures go out as JPEG: of those that were tried it costs the least together with its way through the socket.
//! Slow browsers miss pictures, they never queue.

mod answers;
mod compare;
mod eye;
mod guard;
mod http;
mod hub;
mod job;
mod newest;
mod pictures;
mod server;
mod side;
mod studio;
mod wire;

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use glam::Vec3;
use halflight_image::RgbImage;
use halflight_scene::Scene;
use halflight_scene::schema::Table;

pub use wire::{Ask, MAX_FILE, MAX_TEXT, Side};

/// Where to listen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Address {
    /// The interface; anything but a loopback address asks for a token.
    pub ip: IpAddr,
    /// The port; 0 for any that is free.
    pub port: u16,
}

/// A scene that is ready to be shown.
pub struct Stage {
    /// What it is called.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// What the scene and the command line say about techniques.
    pub settings: Vec<(String, Table)>,
}

/// What is kept of a view: what differs from the scene file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kept {
    /// Where the eye is and what it looks at, if a person has moved it; else the scene's camera stays, with its motion.
    pub place: Option<[Vec3; 2]>,
    /// From the bottom to the top of the picture, if a person chose it.
    pub vertical_fov_degrees: Option<f32>,
    /// Radius of the lens and distance of the plane of focus in metres, if a person chose them.
    pub lens: Option<[f32; 2]>,
    /// In stops.
    pub exposure_ev: f32,
    /// Filmic, or plain sRGB.
    pub filmic: bool,
    /// Columns and rows, if a person chose them.
    pub size: Option<[usize; 2]>,
    /// How far the environment is turned beyond the scene's, and whether there is one.
    pub turn_degrees: f64,
    /// See `turn_degrees`.
    pub has_environment: bool,
    /// Light and materials in place of the scene's.
    pub swap: Swap,
    /// Objects by their numbers in the scene, and how far they were moved in metres.
    pub moved: Vec<(usize, Vec3)>,
    /// The technique of the first side, and what was set about it.
    pub technique: String,
    /// Each `key = value`.
    pub settings: Vec<(String, String)>,
}

/// Light and materials in place of the scene's own.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Swap {
    /// As the command line takes it; empty for the scene's own.
    pub environment: String,
    /// For objects by their numbers in the scene, as the command line takes them.
    pub materials: Vec<(usize, String)>,
}

/// Where scenes come from. Errors are for the person at the page.
pub trait Library: Send {
    /// The names that may be opened.
    fn names(&self) -> Vec<String>;
    /// The environments that may be swapped in.
    fn environments(&self) -> Vec<String>;
    /// Opens a scene by its name.
    ///
    /// # Errors
    /// If there is none, or it cannot be shown.
    fn open(&mut self, name: &str, swap: &Swap) -> Result<Stage, String>;
    /// The stored pictures that may be compared with.
    fn pictures(&self) -> Vec<String>;
    /// A stored picture by its name.
    ///
    /// # Errors
    /// If there is none, or it cannot be read.
    fn picture(&mut self, name: &str) -> Result<RgbImage, String>;
    /// A picture that was dropped on the page.
    ///
    /// # Errors
    /// If it is none.
    fn take_picture(&mut self, name: &str, bytes: &[u8]) -> Result<RgbImage, String>;
    /// Opens what was dropped on the page: the first file that can be shown; the others are what it names.
    ///
    /// # Errors
    /// If it is nothing that can be shown.
    fn take(&mut self, files: &[(String, Vec<u8>)]) -> Result<Stage, String>;
    /// Writes a copy of the scene that is open, with this view; says where, and what could not be kept.
    ///
    /// # Errors
    /// If it cannot be written.
    fn keep(&mut self, kept: &Kept) -> Result<String, String>;
}

/// Why the viewer ended.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ViewError {
    /// The address cannot be listened on.
    #[error("cannot listen on {address}: {reason}")]
    Address {
        /// What was asked for.
        address: SocketAddr,
        /// What was found, and what to try.
        reason: String,
    },
    /// Something else.
    #[error("{0}")]
    Failed(String),
}

impl ViewError {
    fn cannot_listen(address: SocketAddr, error: &std::io::Error) -> Self {
        let reason = match error.kind() {
            std::io::ErrorKind::AddrInUse => {
                "the port is in use; choose another with --port, or --port 0 for any that is free".into()
            }
            std::io::ErrorKind::AddrNotAvailable => "this machine has no such address".into(),
            _ => error.to_string(),
        };
        ViewError::Address { address, reason }
    }
}

/// Shows scenes until `stop` says so. `ready` is told the addresses for browsers, the likeliest first, once somebody may
/// come.
///
/// # Errors
/// If the address cannot be listened on, or the first frame cannot be made.
pub fn view(
    address: Address,
    library: Box<dyn Library>,
    first: Stage,
    technique: &str,
    ready: impl FnOnce(&[String], SocketAddr),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<(), ViewError> {
    let hub = Arc::new(hub::Hub::default());
    let mut studio = studio::Studio::new(Arc::clone(&hub), library, first, technique)?;
    let server = server::start(address, Arc::clone(&hub))?;
    ready(&server.urls, server.address);
    studio.run(stop);
    hub.stop();
    // The thread that accepts waits for somebody to come.
    let _ = std::net::TcpStream::connect(server.address);
    Ok(())
}
