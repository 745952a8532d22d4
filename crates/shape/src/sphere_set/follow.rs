//! From models to sets and back: the surface of a model at rest with the joints that move it, and where they are later.
//!
//! A joint is a node of the model, so one numbering serves any number of skins and also rigid parts that hang on
//! animated nodes. With G_j(t) the transform of node j, M_j(t) = G_j(t) G_j(rest)⁻¹ takes the rest pose to time t; for
//! a vertex of one joint that is exactly what its skin does, since B_j cancels. Morph targets move no sphere.

use glam::{Affine3A, Vec3};

use super::SphereInfluences;
use crate::{Model, TriangleMesh};

/// The surface of a model at rest: what spheres are fitted to.
#[derive(Clone, Debug, Default)]
pub struct RestSurface {
    /// The model's name.
    pub name: String,
    /// All parts as one mesh, in the model's frame; positions and triangles only.
    pub mesh: TriangleMesh,
    /// What moves each vertex; empty if the model does not move.
    pub influences: Vec<SphereInfluences>,
}

impl RestSurface {
    /// A hash of positions, triangles and influences, the same on every machine (FNV-1a over words of four bytes, in
    /// 64 bits).
    pub fn hash(&self) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325u64;
        let mut add = |word: u32| hash = (hash ^ u64::from(word)).wrapping_mul(0x100_0000_01b3);
        add(self.mesh.positions.len() as u32);
        self.mesh.positions.iter().flat_map(|p| p.to_array()).for_each(|x| add(x.to_bits()));
        add(self.mesh.triangles.len() as u32);
        self.mesh.triangles.iter().flatten().for_each(|&v| add(v));
        for influences in &self.influences {
            influences.joints.iter().for_each(|&j| add(u32::from(j)));
            influences.weights.iter().for_each(|w| add(w.to_bits()));
        }
        hash
    }
}

impl Model {
    /// All parts at rest as one mesh, with the joints of the vertices if the model is animated.
    pub fn rest_surface(&self) -> RestSurface {
        let posed = self.pose_in(None, 0.0);
        let mesh = merged(&posed.iter().map(|p| (p.mesh.as_ref(), p.transform)).collect::<Vec<_>>());
        let mut influences = Vec::new();
        if self.is_animated() {
            let parts =
                self.nodes.iter().enumerate().flat_map(|(n, node)| node.meshes.iter().map(move |m| (n, *m)));
            for (node, part) in parts {
                let part = &self.meshes[part];
                let skin = self.nodes[node].skin.zip(part.influences.as_ref());
                for vertex in 0..part.mesh.positions.len() {
                    influences.push(match skin {
                        Some((skin, of)) => strongest((0..of.joints.len()).flat_map(|set| {
                            let joints = of.joints[set][vertex].into_iter();
                            let weights = of.weights[set][vertex].to_array();
                            joints.zip(weights).map(|(j, w)| (self.skins[skin].joints[j as usize], w))
                        })),
                        None => strongest([(node, 1.0)]),
                    });
                }
            }
        }
        RestSurface { name: self.name.clone(), mesh, influences }
    }

    /// All parts at a time of the first animation as one mesh, vertex for vertex as in [`Model::rest_surface`].
    pub fn surface_at(&self, time_seconds: f32) -> TriangleMesh {
        let posed = self.pose(time_seconds);
        merged(&posed.iter().map(|p| (p.mesh.as_ref(), p.transform)).collect::<Vec<_>>())
    }

    /// For each node the transform that takes its rest pose to where it is at a time of the first animation: the joint
    /// matrices of [`super::SphereSet::posed`].
    pub fn rest_to_pose(&self, time_seconds: f32) -> Vec<Affine3A> {
        // Without animations a model is at rest at any time.
        let still = Self { nodes: self.nodes.clone(), ..Self::default() };
        let rest = still.transforms(0.0);
        let step = |(now, rest): (&Affine3A, &Affine3A)| {
            let step = *now * rest.inverse();
            // A node scaled to nothing at rest has no inverse.
            if step.is_finite() { step } else { Affine3A::IDENTITY }
        };
        self.transforms(time_seconds).iter().zip(&rest).map(step).collect()
    }
}

/// Several meshes as one, positions and triangles only.
fn merged(parts: &[(&TriangleMesh, Affine3A)]) -> TriangleMesh {
    let mut whole = TriangleMesh::default();
    for (part, transform) in parts {
        let base = whole.positions.len() as u32;
        let still = *transform == Affine3A::IDENTITY;
        let moved = |p: &Vec3| if still { *p } else { transform.transform_point3(*p) };
        whole.positions.extend(part.positions.iter().map(moved));
        whole.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + base)));
    }
    whole
}

/// The four heaviest of any number of (joint, weight) pairs, their weights scaled to sum to 1; pairs of the same joint
/// are added first. Nothing at all gives no weight, which leaves a sphere where it is.
pub(super) fn strongest(pairs: impl IntoIterator<Item = (usize, f32)>) -> SphereInfluences {
    let mut sums: Vec<(u16, f32)> = Vec::new();
    for (joint, weight) in pairs {
        let Ok(joint) = u16::try_from(joint) else { continue };
        if weight > 0.0 && weight.is_finite() {
            match sums.iter_mut().find(|(j, _)| *j == joint) {
                Some((_, sum)) => *sum += weight,
                None => sums.push((joint, weight)),
            }
        }
    }
    sums.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    sums.truncate(4);
    let total: f32 = sums.iter().map(|(_, w)| w).sum();
    let mut influences = SphereInfluences { joints: [0; 4], weights: [0.0; 4] };
    for (k, (joint, weight)) in sums.into_iter().enumerate() {
        (influences.joints[k], influences.weights[k]) = (joint, weight / total);
    }
    influences
}
