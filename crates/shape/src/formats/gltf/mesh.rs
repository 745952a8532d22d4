//! Primitives to meshes: triangles of every mode, attributes, morph targets, influences of joints.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};
use halflight_file::LoadError;

use super::accessor::Document;
use super::json::{Attributes, Mesh, Primitive};
use super::material::{Materials, Used};
use crate::TriangleMesh;
use crate::mesh::MAX_COORDINATE;
use crate::model::{ModelInfluences, ModelMesh, ModelMorph};

/// Reads the primitives of mesh `index`; lines and points are left out with a warning.
pub(super) fn read(
    index: usize,
    mesh: &Mesh,
    materials: &mut Materials,
    file: &Document,
) -> Result<Vec<ModelMesh>, LoadError> {
    let title =
        if mesh.name.is_empty() { format!("mesh {index}") } else { format!("mesh {index} ({})", mesh.name) };
    let mut meshes = Vec::new();
    for (number, primitive) in mesh.primitives.iter().enumerate() {
        let who = format!("{title}, primitive {number}");
        match primitive.mode.unwrap_or(4) {
            4..=6 => {}
            0..=3 => {
                materials.warnings.push(format!("{who} is made of points or lines and was left out"));
                continue;
            }
            mode => return Err(file.error(format!("{who} has the unknown mode {mode}"))),
        }
        if primitive.attributes.position.is_none() {
            materials.warnings.push(format!("{who} has no positions and was left out"));
            continue;
        }
        let used = materials.slot(primitive.material, &who, file)?;
        let mut converted = read_primitive(primitive, used, &who, file, &mut materials.warnings)?;
        converted.name = mesh.name.clone();
        converted.morph_weights = mesh.weights.clone();
        if mesh.weights.iter().any(|weight| !weight.is_finite()) {
            return Err(file.error(format!("{title}: a weight of its morph targets is not finite")));
        }
        name_targets(&mut converted.morphs, mesh);
        meshes.push(converted);
    }
    Ok(meshes)
}

fn read_primitive(
    primitive: &Primitive,
    used: Used,
    who: &str,
    file: &Document,
    warnings: &mut Vec<String>,
) -> Result<ModelMesh, LoadError> {
    let attributes = &primitive.attributes;
    let positions = vectors(attributes.position, &format!("{who}, POSITION"), file)?;
    let count = positions.len();
    let checked = |name: &str, found: usize| {
        if found == 0 || found == count {
            return Ok(());
        }
        Err(file.error(format!("{who}: there are {count} positions, but {found} of {name}")))
    };
    let normals = vectors(attributes.normal, &format!("{who}, NORMAL"), file)?;
    checked("NORMAL", normals.len())?;
    let tangents: Vec<Vec4> = match attributes.tangent {
        // Without normals, tangents are to be ignored (glTF 2.0, §3.7.2.1).
        Some(index) if !normals.is_empty() => {
            file.floats(index, &format!("{who}, TANGENT"))?.into_iter().map(Vec4::from_array).collect()
        }
        _ => Vec::new(),
    };
    checked("TANGENT", tangents.len())?;
    let uvs = read_uvs(attributes, used, who, file, warnings)?;
    checked("TEXCOORD", uvs.len())?;
    let colors = match attributes.color_0 {
        Some(index) => read_colors(index, &format!("{who}, COLOR_0"), file)?,
        None => Vec::new(),
    };
    checked("COLOR_0", colors.len())?;
    let influences = read_influences(attributes, who, file, warnings)?;
    for (joints, weights) in influences.joints.iter().zip(&influences.weights) {
        checked("JOINTS", joints.len())?;
        checked("WEIGHTS", weights.len())?;
    }
    let mut morphs = Vec::new();
    for (number, target) in primitive.targets.iter().enumerate() {
        let name = |attribute: &str| format!("{who}, {attribute} of morph target {number}");
        let morph = ModelMorph {
            name: String::new(),
            positions: vectors(target.position, &name("POSITION"), file)?,
            normals: if normals.is_empty() {
                Vec::new()
            } else {
                vectors(target.normal, &name("NORMAL"), file)?
            },
            tangents: if tangents.is_empty() {
                Vec::new()
            } else {
                vectors(target.tangent, &name("TANGENT"), file)?
            },
        };
        checked("a morph target's POSITION", morph.positions.len())?;
        checked("a morph target's NORMAL", morph.normals.len())?;
        checked("a morph target's TANGENT", morph.tangents.len())?;
        morphs.push(morph);
    }
    let triangles = read_triangles(primitive, count, who, file, warnings)?;
    let material_slots = if used.slot == 0 { Vec::new() } else { vec![used.slot; triangles.len()] };
    let mesh = TriangleMesh { positions, triangles, normals, uvs, tangents, colors, material_slots };
    let influences = (!influences.joints.is_empty()).then_some(influences);
    let mut converted = ModelMesh { mesh: Arc::new(mesh), morphs, influences, ..ModelMesh::default() };
    drop_unused_vertices(&mut converted);
    let mesh = Arc::make_mut(&mut converted.mesh);
    let flaws = mesh.repair().map_err(|e| file.error(format!("{who}: {e}")))?;
    warnings.extend(flaws.sentences(who));
    if used.wants_tangents && mesh.tangents.is_empty() {
        mesh.compute_tangents();
    }
    Ok(converted)
}

/// Vectors within [`MAX_COORDINATE`]; none if there is no accessor.
fn vectors(index: Option<usize>, who: &str, file: &Document) -> Result<Vec<Vec3>, LoadError> {
    let Some(index) = index else { return Ok(Vec::new()) };
    let vectors: Vec<Vec3> = file.floats(index, who)?.into_iter().map(Vec3::from_array).collect();
    match vectors.iter().position(|v| v.abs().max_element() > MAX_COORDINATE) {
        Some(i) => {
            Err(file
                .error(format!("{who}: element {i} is {}, further out than {MAX_COORDINATE:e}", vectors[i])))
        }
        None => Ok(vectors),
    }
}

fn read_uvs(
    attributes: &Attributes,
    used: Used,
    who: &str,
    file: &Document,
    warnings: &mut Vec<String>,
) -> Result<Vec<Vec2>, LoadError> {
    let wanted = attributes.numbered("TEXCOORD", used.uv_set);
    if wanted.is_none() && used.uv_set > 0 {
        warnings.push(format!("{who} has no TEXCOORD_{}, which its textures ask for", used.uv_set));
    }
    match wanted.or_else(|| attributes.numbered("TEXCOORD", 0)) {
        Some(index) => {
            let uvs = file.floats(index, &format!("{who}, TEXCOORD"))?;
            Ok(uvs.into_iter().map(Vec2::from_array).collect())
        }
        None => Ok(Vec::new()),
    }
}

/// RGB, or RGBA whose opacity is left out.
fn read_colors(index: usize, who: &str, file: &Document) -> Result<Vec<Vec3>, LoadError> {
    let accessor = file.get(&file.root.accessors, index, "accessor", who)?;
    Ok(if accessor.kind == "VEC4" {
        file.floats::<4>(index, who)?.into_iter().map(|[r, g, b, _]| Vec3::new(r, g, b)).collect()
    } else {
        file.floats::<3>(index, who)?.into_iter().map(Vec3::from_array).collect()
    })
}

/// All sets of joints and weights there are, the weights of each vertex normalised to sum 1.
fn read_influences(
    attributes: &Attributes,
    who: &str,
    file: &Document,
    warnings: &mut Vec<String>,
) -> Result<ModelInfluences, LoadError> {
    let mut influences = ModelInfluences::default();
    for set in 0.. {
        let (joints, weights) = (attributes.numbered("JOINTS", set), attributes.numbered("WEIGHTS", set));
        let (Some(joints), Some(weights)) = (joints, weights) else { break };
        let joints = file.integers::<4>(joints, &format!("{who}, JOINTS_{set}"))?;
        let weights = file.floats::<4>(weights, &format!("{who}, WEIGHTS_{set}"))?;
        if joints.len() != weights.len() || influences.joints.first().is_some_and(|j| j.len() != joints.len())
        {
            return Err(file.error(format!("{who}: its JOINTS and WEIGHTS are not of one length")));
        }
        let mut narrow = Vec::with_capacity(joints.len());
        for (vertex, joint) in joints.iter().enumerate() {
            // A joint without weight may be any number.
            let used: [u32; 4] =
                std::array::from_fn(|i| if weights[vertex][i] == 0.0 { 0 } else { joint[i] });
            if let Some(joint) = used.iter().find(|joint| u16::try_from(**joint).is_err()) {
                return Err(file.error(format!("{who}: vertex {vertex} follows joint {joint}")));
            }
            narrow.push(used.map(|joint| joint as u16));
        }
        influences.joints.push(narrow);
        influences.weights.push(weights.into_iter().map(Vec4::from_array).collect());
    }
    let vertices = influences.weights.first().map_or(0, Vec::len);
    let mut without = 0;
    for vertex in 0..vertices {
        let sum: f32 = influences.weights.iter().map(|set| set[vertex].max(Vec4::ZERO).element_sum()).sum();
        for (i, set) in influences.weights.iter_mut().enumerate() {
            set[vertex] = match () {
                () if sum > 0.0 && sum.is_finite() => set[vertex].max(Vec4::ZERO) / sum,
                () if i == 0 => Vec4::X,
                () => Vec4::ZERO,
            };
        }
        without += usize::from(!(sum > 0.0 && sum.is_finite()));
    }
    if without > 0 {
        warnings.push(format!("{who}: {without} vertices have no weights and follow their first joint"));
    }
    Ok(influences)
}

fn read_triangles(
    primitive: &Primitive,
    vertices: usize,
    who: &str,
    file: &Document,
    warnings: &mut Vec<String>,
) -> Result<Vec<[u32; 3]>, LoadError> {
    let indices: Vec<u32> = match primitive.indices {
        Some(index) => {
            let indices = file.integers::<1>(index, &format!("{who}, indices"))?;
            indices.into_iter().map(|[i]| i).collect()
        }
        None => (0..vertices as u32).collect(),
    };
    if let Some((i, index)) = indices.iter().enumerate().find(|(_, index)| **index as usize >= vertices) {
        let found = format!(
            "{who}: index {i} refers to vertex {index}, but there are {vertices} vertices, counted from 0"
        );
        return Err(file.error(found));
    }
    let windows = || indices.windows(3).enumerate();
    Ok(match primitive.mode {
        Some(5) => {
            windows().map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] }).collect()
        }
        // Fans are led by their first vertex, and turn like [second, third, first] (glTF 2.0, §3.7.2.1).
        Some(6) => {
            indices.get(1..).unwrap_or_default().windows(2).map(|w| [w[0], w[1], indices[0]]).collect()
        }
        _ => {
            let (triangles, rest) = indices.as_chunks::<3>();
            if !rest.is_empty() {
                warnings.push(format!("{who}: {} indices at the end make no triangle", rest.len()));
            }
            triangles.to_vec()
        }
    })
}

/// Primitives often share one long list of vertices, of which each uses a part.
fn drop_unused_vertices(converted: &mut ModelMesh) {
    const UNUSED: u32 = u32::MAX;
    let mesh = Arc::make_mut(&mut converted.mesh);
    let mut new_index = vec![UNUSED; mesh.positions.len()];
    mesh.triangles.iter().flatten().for_each(|vertex| new_index[*vertex as usize] = 0);
    if !new_index.contains(&UNUSED) {
        return;
    }
    let used = new_index.iter_mut().filter(|index| **index != UNUSED);
    used.enumerate().for_each(|(next, index)| *index = next as u32);
    mesh.triangles.iter_mut().flatten().for_each(|vertex| *vertex = new_index[*vertex as usize]);
    keep(&mut mesh.positions, &new_index);
    keep(&mut mesh.normals, &new_index);
    keep(&mut mesh.uvs, &new_index);
    keep(&mut mesh.tangents, &new_index);
    keep(&mut mesh.colors, &new_index);
    for morph in &mut converted.morphs {
        keep(&mut morph.positions, &new_index);
        keep(&mut morph.normals, &new_index);
        keep(&mut morph.tangents, &new_index);
    }
    if let Some(influences) = &mut converted.influences {
        influences.joints.iter_mut().for_each(|set| keep(set, &new_index));
        influences.weights.iter_mut().for_each(|set| keep(set, &new_index));
    }
}

/// Keeps the entries that have a new index; `u32::MAX` stands for none.
fn keep<T>(values: &mut Vec<T>, new_index: &[u32]) {
    let mut vertex = 0;
    values.retain(|_| {
        vertex += 1;
        new_index[vertex - 1] != u32::MAX
    });
    values.shrink_to_fit();
}

/// `extras.targetNames`, which many exporters write.
fn name_targets(morphs: &mut [ModelMorph], mesh: &Mesh) {
    let names = mesh.extras.get("targetNames").and_then(|names| names.as_array());
    for (morph, name) in morphs.iter_mut().zip(names.into_iter().flatten()) {
        morph.name = name.as_str().unwrap_or_default().into();
    }
}
