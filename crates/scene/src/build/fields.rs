//! Learned fields of directed distances as shapes.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use halflight_ddf::{DirectedField, FieldTracer, field_points, mesh_hash};
use halflight_file::LoadError;
use halflight_material::{Material, MaterialKind, ScalarInput};
use halflight_trace::{Geometry, MeshTracer, RayGeometry as _};

use super::Builder;
use crate::schema::{FilePath, Problem};
use crate::spec::Shading;

/// A field, with or without its mesh to fall back to.
#[derive(Debug)]
pub(crate) struct FieldShape {
    pub(crate) tracer: FieldTracer,
    geometry: Arc<Geometry>,
}

impl FieldShape {
    fn new(tracer: FieldTracer) -> Self {
        let geometry = Arc::new(Geometry::Custom(Arc::new(tracer.clone())));
        Self { tracer, geometry }
    }

    pub(crate) fn geometry(&self) -> Arc<Geometry> {
        Arc::clone(&self.geometry)
    }

    /// Points of its surface, enough to see how far it reaches.
    pub(crate) fn outline(&self) -> Vec<Vec3> {
        const POINTS: usize = 2000;
        let field = self.tracer.field();
        let unit = field.unit();
        let points = field_points(field, POINTS, 0);
        points.into_iter().map(|p| unit.from_unit(p)).collect()
    }
}

/// The mesh of a field: to fall back to, or only to see whether it is the one that the field was learned from.
pub(crate) struct Beside<'a> {
    pub(crate) file: &'a FilePath,
    pub(crate) fallback: bool,
    /// Whether the shape stands for the file, which then brings materials and motion; not so for a `field` shape.
    pub(crate) is_shape: bool,
    pub(crate) shading: Option<Shading>,
}

impl Builder {
    /// A field from a file, and its mesh if there is one to fall back to.
    pub(crate) fn field(
        &mut self,
        name: &str,
        file: &FilePath,
        beside: Option<Beside<'_>>,
        has_material: bool,
    ) -> Option<FieldShape> {
        let field = match DirectedField::load(&file.path) {
            Ok(field) => Arc::new(field),
            Err(error) => {
                self.failed(file, &error);
                return None;
            }
        };
        self.note_file(&file.path);
        let Some(beside) = beside else { return Some(FieldShape::new(FieldTracer::new(field))) };
        // A mesh that is not needed may be gone: the field is there so that it need not be kept.
        if !beside.fallback && !beside.file.path.exists() {
            return Some(FieldShape::new(FieldTracer::new(field)));
        }
        let model = self.model(beside.file)?;
        if beside.is_shape && model.is_animated() {
            let message = format!(
                "{name}: {} is animated, and a field knows one shape at rest: it would stand still",
                beside.file.path.display()
            );
            let help = "leave the field out, or take a mesh without animation";
            self.reader.report(Problem::new(&file.origin, message).help(help));
            return None;
        }
        if beside.is_shape && !has_material && model.materials.iter().any(|material| !material.stand_in) {
            self.warnings.push(format!(
                "{name}: the materials and textures of {} are left out: a field has one material, that of its shape",
                beside.file.path.display()
            ));
        }
        if beside.shading.is_some() {
            self.warnings.push(format!(
                "{name}: `shading` is left out: a field has normals of its own, which are neither flat nor smooth"
            ));
        }
        let mut mesh = model.rest_surface().mesh;
        if let Err(error) = mesh.repair() {
            let error = LoadError::new("the mesh of a field", &beside.file.path, error.to_string());
            self.failed(beside.file, &error);
            return None;
        }
        if mesh_hash(&mesh) != field.provenance.source_hash {
            self.warnings.push(format!(
                "{}: this is not the mesh that {} was learned from ({}, {} triangles)",
                beside.file.path.display(),
                file.path.display(),
                field.provenance.source,
                field.provenance.source_triangles
            ));
        }
        if !beside.fallback {
            return Some(FieldShape::new(FieldTracer::new(field)));
        }
        let tracer = Arc::new(MeshTracer::build(Arc::new(mesh)));
        Some(FieldShape::new(FieldTracer::with_fallback(field, tracer)))
    }

    /// A field from a path that the program itself names.
    pub(crate) fn bare_field(&mut self, path: &Path) -> Result<FieldShape, LoadError> {
        let field = DirectedField::load(path)?;
        self.note_file(path);
        Ok(FieldShape::new(FieldTracer::new(Arc::new(field))))
    }

    /// Says what a field cannot do with its material.
    pub(crate) fn field_notices(&mut self, name: &str, shape: &FieldShape, index: u32) {
        let material = &self.materials[index as usize];
        let falls_back = shape.tracer.fallback().is_some();
        let mut said = Vec::new();
        if refracts(material) && !shape.tracer.field().knows_sides() && !falls_back {
            said.push(format!(
                "{name}: `{}` lets light through, and this field does not know where light enters and where it leaves: \
                 train it again from the mesh, without --samples and with the fast network, or let it fall back to its mesh \
                 (`field_fallback = true`)",
                material.name
            ));
        }
        if !material.is_uniform() {
            said.push(format!(
                "{name}: the textures of `{}` show one colour only: a field has no texture coordinates",
                material.name
            ));
        }
        self.warnings.extend(said);
    }
}

/// Whether any of a material is refracting.
fn refracts(material: &Material) -> bool {
    material.leaves().into_iter().any(|leaf| match &leaf.kind {
        MaterialKind::Dielectric { .. } => true,
        MaterialKind::MetallicRoughness { transmission: ScalarInput::Constant(part), .. } => *part > 0.0,
        MaterialKind::MetallicRoughness { .. } => true,
        _ => false,
    })
}
