//! The surface where values on a lattice change their sign, as a mesh.

use glam::Vec3;

use crate::TriangleMesh;

/// A lattice of posts in space; x runs fastest.
#[derive(Clone, Copy, Debug)]
pub struct Lattice {
    /// Posts along x, y and z.
    pub posts: [usize; 3],
    /// The first post.
    pub low: Vec3,
    /// From post to post.
    pub step: f32,
}

impl Lattice {
    /// How many posts there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.posts.iter().product()
    }

    /// The number of a post.
    fn index(&self, x: usize, y: usize, z: usize) -> usize {
        (z * self.posts[1] + y) * self.posts[0] + x
    }

    /// The surface between posts of negative values and others, facing those: surface nets (Gibson 1998), a vertex in
    /// each cell that the surface crosses, at the mean of its crossings, and a quadrilateral for each edge. It is
    /// closed if all values on the border have one sign. No normals, no texture coordinates.
    #[must_use]
    pub fn surface_net(&self, value: impl Fn(usize) -> f32) -> TriangleMesh {
        let [across, up, deep] = self.posts;
        let mut mesh = TriangleMesh::default();
        let mut vertex = vec![u32::MAX; self.count()];
        for z in 0..deep.saturating_sub(1) {
            for y in 0..up.saturating_sub(1) {
                for x in 0..across.saturating_sub(1) {
                    let corners: [f32; 8] = std::array::from_fn(|c| {
                        value(self.index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)))
                    });
                    if let Some(local) = mean_crossing(&corners) {
                        vertex[self.index(x, y, z)] = mesh.positions.len() as u32;
                        let place = Vec3::new(x as f32, y as f32, z as f32) + local;
                        mesh.positions.push(self.low + self.step * place);
                    }
                }
            }
        }
        for z in 1..deep.saturating_sub(1) {
            for y in 1..up.saturating_sub(1) {
                for x in 1..across.saturating_sub(1) {
                    let inside = value(self.index(x, y, z)) < 0.0;
                    let edges = [
                        (self.index(x + 1, y, z), [(0, 0, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1)]),
                        (self.index(x, y + 1, z), [(0, 0, 0), (0, 0, 1), (1, 0, 1), (1, 0, 0)]),
                        (self.index(x, y, z + 1), [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]),
                    ];
                    for (other, around) in edges {
                        if inside == (value(other) < 0.0) {
                            continue;
                        }
                        let mut quad = around.map(|(a, b, c)| vertex[self.index(x - a, y - b, z - c)]);
                        if !inside {
                            quad.reverse();
                        }
                        mesh.triangles.push([quad[0], quad[1], quad[2]]);
                        mesh.triangles.push([quad[0], quad[2], quad[3]]);
                    }
                }
            }
        }
        mesh.triangles.retain(|t| t.iter().all(|&v| v != u32::MAX));
        mesh
    }
}

/// The mean of the places where values change sign along the edges of a unit cube; corner c lies at its three bits.
fn mean_crossing(corners: &[f32; 8]) -> Option<Vec3> {
    let (mut sum, mut count) = (Vec3::ZERO, 0.0);
    for a in 0..8usize {
        for axis in [1, 2, 4] {
            let b = a | axis;
            if a & axis != 0 || (corners[a] < 0.0) == (corners[b] < 0.0) {
                continue;
            }
            let at = |c: usize| Vec3::new((c & 1) as f32, (c >> 1 & 1) as f32, (c >> 2) as f32);
            let part = (corners[a] / (corners[a] - corners[b])).clamp(0.0, 1.0);
            sum += at(a).lerp(at(b), part);
            count += 1.0;
        }
    }
    (count > 0.0).then(|| sum / count)
}
