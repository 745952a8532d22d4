//! Complex indices of refraction of some metals, η + ik at red, green and blue.
//!
//! The spectra are the handbook values collected at refractiveindex.info, weighted by the colour matching functions
//! into linear Rec. 709, as the Tungsten renderer tabulates them.

use glam::Vec3;

/// Name, η, k.
const METALS: [(&str, Vec3, Vec3); 11] = [
    ("aluminium", Vec3::new(1.65746, 0.880369, 0.521229), Vec3::new(9.22387, 6.26952, 4.83700)),
    ("chromium", Vec3::new(4.36968, 2.91670, 1.65470), Vec3::new(5.20643, 4.23136, 3.75495)),
    ("copper", Vec3::new(0.200438, 0.924033, 1.102212), Vec3::new(3.91295, 2.45285, 2.14219)),
    ("gold", Vec3::new(0.143119, 0.374957, 1.442479), Vec3::new(3.98316, 2.38572, 1.60322)),
    ("iridium", Vec3::new(3.08641, 2.08219, 1.61789), Vec3::new(5.59215, 4.06718, 3.26726)),
    ("lithium", Vec3::new(0.265787, 0.195610, 0.220920), Vec3::new(3.54017, 2.31113, 1.66859)),
    ("mercury", Vec3::new(2.39893, 1.44003, 0.909551), Vec3::new(6.32763, 4.37194, 3.42179)),
    ("silver", Vec3::new(0.155265, 0.116723, 0.138381), Vec3::new(4.82834, 3.12225, 2.14695)),
    ("titanium-nitride", Vec3::new(1.64847, 1.15045, 1.37978), Vec3::new(3.36846, 1.94349, 1.10201)),
    ("tungsten", Vec3::new(4.37070, 3.30030, 2.99827), Vec3::new(3.50068, 2.60487, 2.27319)),
    ("vanadium", Vec3::new(4.27751, 3.51315, 2.76113), Vec3::new(3.49118, 2.88936, 3.11170)),
];

/// The names that [`metal`] knows.
pub fn metal_names() -> impl Iterator<Item = &'static str> {
    METALS.iter().map(|(name, ..)| *name)
}

/// η and k of a metal by its name.
pub fn metal(name: &str) -> Option<(Vec3, Vec3)> {
    let name = if name == "aluminum" { "aluminium" } else { name };
    METALS.iter().find(|(known, ..)| *known == name).map(|&(_, eta, k)| (eta, k))
}
