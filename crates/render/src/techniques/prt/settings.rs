//! The settings of `prt`.

use halflight_scene::schema::{FilePath, at_least, positive, within};
use halflight_scene::{choices, record};

choices! {
    /// What precomputed transfer knows of.
    pub enum TransferKind, "transfer of prt" {
        /// The cosine alone: nothing blocks light. No rays are cast.
        "unshadowed" => Unshadowed,
        /// What is in the way blocks light.
        "shadowed" => Shadowed,
        /// What is in the way blocks light and gives back its own.
        "interreflected" => Interreflected,
    }
}

record! {
    /// Precomputed radiance transfer: soft shadows and interreflection in a scene that stands still, under an
    /// environment that may turn or change in every frame.
    pub struct PrtSettings, "[technique.prt]" {
        /// What transfer knows of.
        #[example = "\"interreflected\""]
        transfer: TransferKind = TransferKind::Shadowed,
        /// Bands of the spherical harmonics, from 3 to 6. More are sharper and cost more.
        #[example = "6"]
        order: u32 = 4 => within(3.0, 6.0),
        /// How often light may be given back before it reaches a point, for `"interreflected"`.
        #[example = "3"]
        bounces: u32 = 1 => within(1.0, 64.0),
        /// Directions over the hemisphere of each vertex.
        #[example = "2048"]
        rays: u32 = 512 => within(16.0, 65536.0),
        /// Longest edge between two points of transfer; 1/64 of the diagonal of the scene unless given.
        #[unit = "m"]
        #[example = "0.1"]
        max_edge: Option<f32> => positive(),
        /// How often an edge may be halved beyond that where transfer changes.
        #[example = "0"]
        subdivisions: u32 = 4 => within(0.0, 12.0),
        /// Error of interpolation above which edges are halved, in parts of the unshadowed transfer.
        #[example = "0.01"]
        tolerance: f32 = 0.02 => positive(),
        /// Most points of transfer: no edge is halved beyond them.
        #[example = "1000000"]
        max_vertices: u32 = 200_000 => at_least(1.0),
        /// File, or folder of files, that transfer is kept in from run to run; kept in memory only unless given.
        #[example = "\"terrain.safetensors\""]
        cache: Option<FilePath>,
    }
}

impl Default for PrtSettings {
    fn default() -> Self {
        Self {
            transfer: TransferKind::Shadowed,
            order: 4,
            bounces: 1,
            rays: 512,
            max_edge: None,
            subdivisions: 4,
            tolerance: 0.02,
            max_vertices: 200_000,
            cache: None,
        }
    }
}

impl PrtSettings {
    /// How often light is given back.
    pub(super) fn bounces(&self) -> u32 {
        if self.transfer == TransferKind::Interreflected { self.bounces } else { 0 }
    }
}
