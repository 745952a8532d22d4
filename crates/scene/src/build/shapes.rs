//! Shapes of scene files, as objects that can be posed.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use glam::{Affine3A, Quat, Vec2, Vec3};
use halflight_shape::procedural::mesh as generate;
use halflight_shape::{Model, TriangleMesh};
use halflight_trace::Geometry;

use super::fields::{Beside, FieldShape};
use super::meshes::Finish;
use super::node_spheres::NodeSpheres;
use super::{Builder, HeightSource, MaterialEntry, MeshPart, ModelShape};
use crate::frame::MOST_SHINING_FACETS;
use crate::geometry;
use crate::motion::Track;
use crate::schema::{At, FilePath, Origin, Problem};
use crate::spec::{
    GeneratedName, GeneratedSpec, MeshSpec, Shading, ShapeKind, ShapeSpec, SpheresSpec, TransformSpec,
    TrianglesSpec,
};

/// Something that can be seen, as a function of time.
pub(crate) struct Object {
    pub(crate) name: String,
    pub(crate) form: Form,
    /// Material of each slot; at least one.
    pub(crate) materials: Arc<[u32]>,
    /// Where copies stand.
    pub(crate) places: Vec<Affine3A>,
    /// Motion, applied after the place.
    pub(crate) track: Option<Track>,
    /// Whether it is a mere background, which framing does not look at.
    pub(crate) ground: bool,
}

/// What an object is made of, in its own space.
pub(crate) enum Form {
    Mesh(MeshPart),
    Model(Box<ModelShape>),
    Spheres(Vec<(Vec3, f32)>, OnceLock<Arc<Geometry>>),
    /// Spheres that move one by one.
    MovingSpheres(NodeSpheres),
    /// The square [−1, 1]² of the xy-plane, facing +z.
    Rectangle,
    /// The unit disk of the xy-plane, facing +z.
    Disk,
    Heights(HeightSource, OnceLock<Arc<Geometry>>),
    Field(FieldShape),
}

/// Turns what faces +z so that it faces +y.
pub(crate) fn facing_up() -> Affine3A {
    Affine3A::from_quat(Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2))
}

/// The most copies of one shape.
const MOST_INSTANCES: usize = 1_000_000;

impl Builder {
    /// Builds every `[[shape]]`.
    pub(crate) fn shapes(&mut self, shapes: &[At<ShapeSpec>]) -> Vec<Object> {
        let mut names: Vec<&At<String>> = Vec::new();
        for shape in shapes {
            let Some(name) = &shape.common.name else { continue };
            if let Some(first) = names.iter().find(|known| known.value == name.value) {
                let (line, _) = first.origin.line_column();
                let message = format!("there is another shape `{}`, in line {line}", name.value);
                self.reader
                    .report(Problem::new(&name.origin, message).help("give each shape a name of its own"));
            }
            names.push(name);
        }
        shapes.iter().enumerate().filter_map(|(index, shape)| self.shape(index, shape)).collect()
    }

    fn shape(&mut self, index: usize, shape: &ShapeSpec) -> Option<Object> {
        let common = &shape.common;
        let name =
            common.name.as_ref().map_or_else(|| format!("shape {}", index + 1), |name| name.value.clone());
        let material = self.referred(common.material.as_ref(), &name);
        let placed = self.transform(common.transform.as_ref());
        let places = if common.instances.is_empty() {
            vec![placed]
        } else {
            if common.instances.len() > MOST_INSTANCES {
                self.reader.report(Problem::new(&shape.origin, "more than a million instances"));
                return None;
            }
            common.instances.iter().map(|instance| self.transform(Some(instance)) * placed).collect()
        };
        let track = match Track::new(&common.keyframes, common.repeat) {
            Ok(track) => track,
            Err(problem) => {
                self.reader.report(problem);
                None
            }
        };
        let form = self.form(&name, shape, material.clone())?;
        let (form, materials, local, ground) = form;
        self.notices(&name, &form, &materials, material.as_ref());
        let places: Vec<Affine3A> = places.into_iter().map(|place| place * local).collect();
        if places.iter().any(|place| !place.is_finite()) {
            self.reader.report(Problem::new(
                &shape.origin,
                "the transforms of this shape leave the range of numbers",
            ));
            return None;
        }
        Some(Object { name, form, materials, places, track, ground })
    }

    /// Says what a shape cannot do.
    fn notices(&mut self, name: &str, form: &Form, materials: &[u32], material: Option<&MaterialEntry>) {
        let displaced = material.is_some_and(|entry| entry.displacement.is_some());
        if displaced
            && matches!(form, Form::Spheres(..) | Form::MovingSpheres(_) | Form::Heights(..) | Form::Field(_))
        {
            self.warnings.push(format!(
                "{name}: the displacement is left out: `spheres`, fields and height fields have no vertices to move; \
                 use a `sphere`, or a mesh"
            ));
        }
        if let (Form::Field(shape), Some(&index)) = (form, materials.first()) {
            self.field_notices(name, shape, index);
        }
        let shines = materials.iter().any(|&index| self.materials[index as usize].is_emissive());
        if matches!(form, Form::Field(_)) && shines {
            self.warnings.push(format!(
                "{name}: the light of a shining field is found by chance alone, which is noisy; its mesh is sampled as a light"
            ));
        }
        if let Form::Heights(source, _) = form
            && shines
            && source.facets() > MOST_SHINING_FACETS
        {
            self.warnings.push(format!(
                "{name}: the light of so large a shining height field is found by chance alone, which is noisy; up to \
                 {MOST_SHINING_FACETS} triangles are sampled as lights (360 × 360 posts)"
            ));
        }
    }

    fn transform(&mut self, spec: Option<&TransformSpec>) -> Affine3A {
        match spec.map(TransformSpec::resolve) {
            None => Affine3A::IDENTITY,
            Some(Ok(transform)) => transform,
            Some(Err(problem)) => {
                self.reader.report(problem);
                Affine3A::IDENTITY
            }
        }
    }

    /// The form, its materials, the transform to where its own space stands, and whether it is a mere background.
    #[allow(clippy::type_complexity)]
    fn form(
        &mut self,
        name: &str,
        shape: &ShapeSpec,
        material: Option<MaterialEntry>,
    ) -> Option<(Form, Arc<[u32]>, Affine3A, bool)> {
        let one = |builder: &mut Self| -> Arc<[u32]> {
            Arc::from([material.as_ref().map_or_else(|| builder.default_material(), |entry| entry.index)])
        };
        let scaled = |x: f32, y: f32| Affine3A::from_scale(Vec3::new(x, y, 1.0));
        let still = Affine3A::IDENTITY;
        if let Some((mesh, ground)) =
            material.as_ref().filter(|entry| entry.displacement.is_some()).and_then(|_| as_mesh(&shape.kind))
        {
            return Some((self.mesh_form(name, mesh, None, &material), one(self), still, ground));
        }
        Some(match &shape.kind {
            ShapeKind::Mesh(MeshSpec { file, field: Some(field), field_fallback, shading, .. }) => {
                let beside = Beside { file, fallback: *field_fallback, is_shape: true, shading: *shading };
                let form = self.field(name, field, Some(beside), material.is_some())?;
                (Form::Field(form), one(self), still, false)
            }
            ShapeKind::Field(spec) => {
                let beside = spec.mesh.as_ref();
                let beside =
                    beside.map(|file| Beside { file, fallback: true, is_shape: false, shading: None });
                let form = self.field(name, &spec.file, beside, material.is_some())?;
                (Form::Field(form), one(self), still, false)
            }
            ShapeKind::Mesh(spec) => {
                let (form, materials) = self.model_shape(name, spec, material)?;
                (form, materials, still, false)
            }
            ShapeKind::Triangles(spec) => {
                let mesh = self.triangles(spec)?;
                (self.mesh_form(name, mesh, None, &material), one(self), still, false)
            }
            ShapeKind::Generated(spec) => {
                let mesh = generated(spec);
                if let Some(file) = &spec.file {
                    let model = self.model(file)?;
                    let (form, materials) =
                        self.place_model(name, &model, file, None, (0.0, 1.0, true), material);
                    let Some(local) = in_place_of(&mesh, &form.outline(0.0)) else {
                        self.reader.report(Problem::new(
                            &shape.origin,
                            format!(
                                "{} has no height, so it cannot take the place of another mesh",
                                file.path.display()
                            ),
                        ));
                        return None;
                    };
                    return Some((form, materials, local, false));
                }
                let slots = mesh.material_slots.iter().max().map_or(1, |&slot| slot as usize + 1);
                let index = one(self)[0];
                let form = self.mesh_form(name, mesh, Some(spec.shading), &material);
                (form, vec![index; slots].into(), still, false)
            }
            ShapeKind::Box(spec) => {
                let rounding = spec.rounding.value;
                let most = 0.5 * spec.size.min_element();
                if rounding > most {
                    let message = format!(
                        "a rounding of {rounding} does not fit: at most {most}, half of the least size"
                    );
                    self.reader.report(Problem::new(&spec.rounding.origin, message));
                    return None;
                }
                let (mesh, shading) = if rounding > 0.0 {
                    (generate::rounded_box(spec.size, rounding, 6), None)
                } else {
                    (generate::cuboid(spec.size), Some(Shading::Flat))
                };
                (self.mesh_form(name, mesh, shading, &material), one(self), still, false)
            }
            ShapeKind::Sphere(spec) => {
                (Form::Spheres(vec![(spec.center, spec.radius)], OnceLock::new()), one(self), still, false)
            }
            ShapeKind::Spheres(spec) => (self.spheres(spec, &shape.origin)?, one(self), still, false),
            ShapeKind::Rectangle(spec) => {
                (Form::Rectangle, one(self), scaled(0.5 * spec.size.x, 0.5 * spec.size.y), false)
            }
            ShapeKind::Disk(spec) => (Form::Disk, one(self), scaled(spec.radius, spec.radius), false),
            ShapeKind::Plane(spec) => {
                let up = Affine3A::from_translation(Vec3::Y * spec.y) * facing_up();
                (Form::Rectangle, one(self), up * scaled(spec.half_extent, spec.half_extent), true)
            }
            ShapeKind::HeightField(spec) => {
                let source = self.heights(spec)?;
                (Form::Heights(source, OnceLock::new()), one(self), still, false)
            }
        })
    }

    fn mesh_form(
        &mut self,
        name: &str,
        mesh: TriangleMesh,
        shading: Option<Shading>,
        material: &Option<MaterialEntry>,
    ) -> Form {
        let finish = self.finish(shading, material.as_ref(), &[]);
        let warnings = &mut self.warnings;
        let mesh = finish.apply(&Arc::new(mesh), &mut |why| warnings.push(format!("{name}: {why}")));
        Form::Mesh(MeshPart::new(mesh))
    }

    fn finish(&self, shading: Option<Shading>, entry: Option<&MaterialEntry>, materials: &[u32]) -> Finish {
        let mut used = materials.iter().chain(entry.map(|entry| &entry.index));
        let tangents = used.any(|&index| self.materials[index as usize].needs_tangents());
        Finish { shading, displacement: entry.and_then(|entry| entry.displacement.clone()), tangents }
    }

    fn model_shape(
        &mut self,
        name: &str,
        spec: &MeshSpec,
        material: Option<MaterialEntry>,
    ) -> Option<(Form, Arc<[u32]>)> {
        let model = self.model(&spec.file)?;
        let clock = (spec.animation_start, spec.animation_speed, spec.animation_loop);
        Some(self.place_model(name, &model, &spec.file, spec.shading, clock, material))
    }

    /// A model with its own materials, or with one for all of it.
    pub(crate) fn place_model(
        &mut self,
        name: &str,
        model: &Arc<Model>,
        file: &FilePath,
        shading: Option<Shading>,
        clock: (f64, f64, bool),
        material: Option<MaterialEntry>,
    ) -> (Form, Arc<[u32]>) {
        let slots = model.materials.len().max(1);
        let materials: Arc<[u32]> = match &material {
            Some(entry) => vec![entry.index; slots].into(),
            None if model.materials.iter().all(|m| m.stand_in) => vec![self.default_material(); slots].into(),
            None => self.model_materials(model, file).into(),
        };
        let finish = self.finish(shading, material.as_ref(), &materials);
        let warnings = &mut self.warnings;
        let mut warn = |why: String| {
            let warning = format!("{name}: {why}");
            if !warnings.contains(&warning) {
                warnings.push(warning);
            }
        };
        let shape = ModelShape::new(Arc::clone(model), finish, clock, &mut warn);
        (Form::Model(Box::new(shape)), materials)
    }

    /// A model from a path that the program itself names.
    pub(crate) fn bare_model(&mut self, path: &Path) -> Result<Arc<Model>, halflight_file::LoadError> {
        let model = Arc::new(halflight_shape::load_model(path)?);
        self.note_file(path);
        self.warnings.extend(model.warnings.iter().cloned());
        Ok(model)
    }

    /// Spheres that are written down, or nodes of a file.
    fn spheres(&mut self, spec: &SpheresSpec, origin: &Origin) -> Option<Form> {
        let list = match (&spec.spheres, &spec.file) {
            (Some(list), None) => list,
            (None, Some(file)) => {
                let model = self.model(file)?;
                let spheres = NodeSpheres::new(model);
                if spheres.is_empty() {
                    let message = "this file has no nodes that could be spheres";
                    self.reader.report(Problem::new(&file.origin, message));
                    return None;
                }
                return Some(Form::MovingSpheres(spheres));
            }
            _ => {
                let problem = Problem::new(origin, "expected either `spheres` or `file`");
                self.reader
                    .report(problem.help("as in spheres = [[0, 0.5, 0, 0.5]]: x, y, z and radius of each"));
                return None;
            }
        };
        if let Some(bad) = list.iter().find(|sphere| sphere[3] <= 0.0) {
            let message = format!("a sphere's radius must be greater than 0, found {}", bad[3]);
            self.reader.report(Problem::new(&list.origin, message));
            return None;
        }
        let spheres = list.iter().map(|&[x, y, z, radius]| (Vec3::new(x, y, z), radius)).collect();
        Some(Form::Spheres(spheres, OnceLock::new()))
    }

    fn triangles(&mut self, spec: &TrianglesSpec) -> Option<TriangleMesh> {
        let vertices = spec.positions.len();
        let counts = [
            spec.normals.as_ref().map(|normals| (&normals.origin, normals.len(), "normals")),
            spec.uvs.as_ref().map(|uvs| (&uvs.origin, uvs.len(), "texture coordinates")),
        ];
        for (origin, count, what) in counts.into_iter().flatten() {
            if count != vertices {
                let message = format!("{count} {what} for {vertices} positions");
                self.reader.report(
                    Problem::new(origin, message).help("write one for each position, or none at all"),
                );
                return None;
            }
        }
        let mut mesh = TriangleMesh {
            positions: spec.positions.value.clone(),
            triangles: spec.triangles.value.clone(),
            normals: spec.normals.as_ref().map(|n| n.value.clone()).unwrap_or_default(),
            uvs: spec.uvs.as_ref().map(|uvs| uvs.value.clone()).unwrap_or_default(),
            ..TriangleMesh::default()
        };
        if let Err(error) = mesh.repair() {
            self.reader.report(Problem::new(&spec.triangles.origin, error.to_string()));
            return None;
        }
        Some(mesh)
    }
}

/// A shape that is exact otherwise as a mesh whose vertices can be moved, and whether it is mere ground.
fn as_mesh(kind: &ShapeKind) -> Option<(TriangleMesh, bool)> {
    // From a ground that faces +y to a wall that faces +z.
    let upright = Affine3A::from_quat(Quat::from_rotation_x(std::f32::consts::FRAC_PI_2));
    Some(match kind {
        ShapeKind::Rectangle(spec) => (generate::plane(spec.size, 1, 1).transformed(&upright), false),
        ShapeKind::Disk(spec) => (generate::disk(spec.radius, 128).transformed(&upright), false),
        ShapeKind::Plane(spec) => {
            let ground = generate::plane(Vec2::splat(2.0 * spec.half_extent), 1, 1);
            (ground.transformed(&Affine3A::from_translation(Vec3::Y * spec.y)), true)
        }
        ShapeKind::Sphere(spec) => {
            let mut ball = generate::uv_sphere(spec.radius, 256, 128);
            // The middle of the picture stands towards +z, as on the exact sphere.
            ball.uvs.iter_mut().for_each(|uv| uv.x -= 0.25);
            (ball.transformed(&Affine3A::from_translation(spec.center)), false)
        }
        _ => return None,
    })
}

/// What scales points to the height of a mesh and puts the middle of their box where that of the mesh is.
fn in_place_of(mesh: &TriangleMesh, points: &[Vec3]) -> Option<Affine3A> {
    let bounds = points.iter().fold((Vec3::MAX, Vec3::MIN), |(low, high), &p| (low.min(p), high.max(p)));
    let [(low, high), (old_low, old_high)] = [mesh.bounds()?, bounds];
    let scale = (high.y - low.y) / (old_high.y - old_low.y);
    let moved = Affine3A::from_translation(0.5 * (low + high))
        * Affine3A::from_scale(Vec3::splat(scale))
        * Affine3A::from_translation(-0.5 * (old_low + old_high));
    (scale > 0.0 && moved.is_finite()).then_some(moved)
}

fn generated(spec: &GeneratedSpec) -> TriangleMesh {
    let (radius, tube, height, around) = (spec.radius, spec.tube, spec.height, spec.detail as usize);
    match spec.mesh {
        GeneratedName::Torus => generate::torus(radius, tube, around, (around / 2).max(3)),
        GeneratedName::Knot => generate::knot(spec.p, spec.q, radius, tube, 4 * around, (around / 4).max(3)),
        // Twenty triangles in four parts each time: about as many around as asked for.
        GeneratedName::IcoSphere => generate::ico_sphere(radius, (spec.detail / 5).max(1).ilog2().min(8)),
        GeneratedName::Cylinder => generate::cylinder(radius, height, around),
        GeneratedName::Cone => generate::cone(radius, height, around),
        GeneratedName::Vase => generate::vase(around),
        GeneratedName::Pot => generate::pot(around),
        GeneratedName::Monolith => generate::monolith(),
        GeneratedName::Blob => generate::blob(radius, spec.seed, (spec.detail / 5).max(1).ilog2().min(8)),
        GeneratedName::ShaderBall => generate::shader_ball(around),
        GeneratedName::Figure => generate::figure(height),
        GeneratedName::Rabbit => generate::rabbit(height, around),
        GeneratedName::Seated => generate::seated(height, around),
        GeneratedName::Dragon => generate::dragon(height, around),
        GeneratedName::Car => generate::car_body(height, around),
    }
}

impl Form {
    /// Points of the surface at a time, enough to see how far it reaches.
    pub(crate) fn outline(&self, time: f64) -> Vec<Vec3> {
        /// More vertices than this of one mesh are thinned out.
        const MANY: usize = 4096;
        let of_mesh = |mesh: &TriangleMesh, place: &Affine3A| -> Vec<Vec3> {
            // The corners of the box hold what thinning might lose.
            let (low, high) = mesh.bounds().unwrap_or_default();
            let step = mesh.triangles.len() * 3 / MANY + 1;
            let vertices = mesh.triangles.iter().flatten().step_by(step).map(|&v| mesh.positions[v as usize]);
            let extremes = mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]);
            let extremes = extremes.filter(|p| p.cmpeq(low).any() || p.cmpeq(high).any()).take(64);
            vertices.chain(extremes).map(|p| place.transform_point3(p)).collect()
        };
        match self {
            Self::Mesh(part) => of_mesh(&part.mesh, &Affine3A::IDENTITY),
            Self::Model(model) => {
                model.meshes(time).iter().flat_map(|(mesh, place)| of_mesh(mesh, place)).collect()
            }
            Self::MovingSpheres(spheres) => Self::Spheres(spheres.at(time), OnceLock::new()).outline(time),
            Self::Spheres(spheres, _) => {
                let around = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
                let corners = around.into_iter().chain(diagonals());
                let corners: Vec<Vec3> = corners.collect();
                spheres
                    .iter()
                    .flat_map(|&(c, r)| corners.iter().map(move |&d| c + r * d).collect::<Vec<_>>())
                    .collect()
            }
            Self::Rectangle | Self::Disk => [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|p| Vec2::from(p).extend(0.0))
                .to_vec(),
            Self::Field(field) => field.outline(),
            Self::Heights(source, _) => {
                source.at(time).map(|field| geometry::outline(&field)).unwrap_or_default()
            }
        }
    }

    /// Whether its shape depends on time.
    pub(crate) fn is_animated(&self) -> bool {
        match self {
            Self::Model(model) => model.is_animated(),
            Self::MovingSpheres(spheres) => spheres.is_animated(),
            Self::Heights(source, _) => source.is_animated(),
            _ => false,
        }
    }
}

fn diagonals() -> impl Iterator<Item = Vec3> {
    (0..8).map(|i| {
        let sign = |bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
        Vec3::new(sign(0), sign(1), sign(2)) / 3f32.sqrt()
    })
}

impl Object {
    /// Points of the object in the world at a time, enough to see how far it reaches.
    pub(crate) fn outline(&self, time: f64) -> Vec<Vec3> {
        let local = self.form.outline(time);
        let moved = self.track.as_ref().map_or(Affine3A::IDENTITY, |track| track.over([time; 2])[0]);
        self.places
            .iter()
            .flat_map(|place| {
                let to_world = moved * *place;
                local.iter().map(move |&p| to_world.transform_point3(p)).collect::<Vec<_>>()
            })
            .filter(|p| p.is_finite())
            .collect()
    }

    /// Whether anything of it depends on time.
    pub(crate) fn is_animated(&self) -> bool {
        self.form.is_animated() || self.track.as_ref().is_some_and(Track::moves)
    }

    /// Seconds until its motion ends or begins again.
    pub(crate) fn duration(&self) -> Option<f64> {
        let of_form = match &self.form {
            Form::Model(model) => model.duration(),
            Form::MovingSpheres(spheres) => spheres.duration(),
            _ => None,
        };
        let of_track = self.track.as_ref().filter(|track| track.moves()).map(Track::end);
        of_form.into_iter().chain(of_track).reduce(f64::max)
    }
}
