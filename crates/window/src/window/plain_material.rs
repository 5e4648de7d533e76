//! A material for machines that draw with the processor: its shader decides nothing.
//!
//! The renderer's own material asks its uniforms which lights, fog and maps there are. Mesa's
//! software driver translates such a shader anew for every draw and keeps each translation; one
//! without branches it translates once.

use std::any::Any;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;

use kiss3d::glamx::Mat4;
use kiss3d::post_processing::{OIT_ACCUM_FORMAT, OIT_REVEAL_FORMAT};
use kiss3d::prelude::{
    Camera3d, Context, GpuData, GpuMesh3d, InstancesBuffer3d, LightCollection, Material3d,
    ObjectData3d, Pose3, RenderContext, RenderPhase, Texture, Vec3, multisample_state,
};
use kiss3d::resource::vertex_index::VERTEX_INDEX_FORMAT;

use super::environment::wall;
use super::units::UNITS_PER_M;
use crate::view::ground_shade::{Capsule, MAX_CAPSULES};
use crate::view::light::{FILL, FOG_M, KEY, WRAP};

/// A material as scene nodes share it.
pub type SharedMaterial = Rc<RefCell<Box<dyn Material3d>>>;

/// Capsules that darken the ground, shared between the scene that knows and the material that draws it.
pub type SharedCapsules = Rc<RefCell<Vec<Capsule>>>;

/// Numbers that one object's uniforms consist of; see `Drawn` in the shader.
const NUMBERS: usize = 3 * 16 + 10 * 4 + MAX_CAPSULES * 8;

/// Light by formulas: one lamp, one fill, the surroundings; no shadows but those on the ground.
pub struct PlainMaterial {
    /// Capsules that darken the surface, for the material of the ground.
    capsules: Option<SharedCapsules>,
    shader: wgpu::ShaderModule,
    bindings: wgpu::BindGroupLayout,
    layout: wgpu::PipelineLayout,
    pipelines: BTreeMap<Way, wgpu::RenderPipeline>,
}

/// A kind of drawing; each has a pipeline.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Way {
    samples: u32,
    is_culled: bool,
    is_transparent: bool,
}

/// Buffers and bindings of one object on the graphics card.
struct PlainData {
    uniforms: wgpu::Buffer,
    /// The bindings, and the texture that they were made for.
    bound: Option<(Arc<Texture>, wgpu::BindGroup)>,
}

impl GpuData for PlainData {
    fn as_any(&self) -> &dyn Any {
        self
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }
}

impl PlainMaterial {
    /// A material for bodies.
    pub fn of_bodies() -> SharedMaterial {
        Rc::new(RefCell::new(Box::new(Self::new(None))))
    }

    /// A material for the ground, which is darker below the capsules.
    pub fn of_ground(capsules: SharedCapsules) -> SharedMaterial {
        Rc::new(RefCell::new(Box::new(Self::new(Some(capsules)))))
    }

    fn new(capsules: Option<SharedCapsules>) -> Self {
        let context = Context::get();
        let shader =
            context.create_shader_module(Some("plain"), include_str!("plain_material.wgsl"));
        let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty,
            count: None,
        };
        let uniforms = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let picture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let bindings = context.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("plain"),
            entries: &[
                entry(0, wgpu::ShaderStages::VERTEX_FRAGMENT, uniforms),
                entry(1, wgpu::ShaderStages::FRAGMENT, picture),
                entry(2, wgpu::ShaderStages::FRAGMENT, sampler),
            ],
        });
        let layout = context.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("plain"),
            bind_group_layouts: &[Some(&bindings)],
            immediate_size: 0,
        });
        Self { capsules, shader, bindings, layout, pipelines: BTreeMap::new() }
    }

    fn pipeline(&mut self, way: Way) -> &wgpu::RenderPipeline {
        let Self { capsules, shader, layout, pipelines, .. } = self;
        let entry = match (way.is_transparent, capsules) {
            (true, _) => "transparent",
            (false, Some(_)) => "ground",
            (false, None) => "opaque",
        };
        pipelines.entry(way).or_insert_with(|| new_pipeline(layout, shader, entry, way))
    }

    /// The numbers of one object, in the shader's order.
    fn numbers(
        &self,
        pose: Pose3,
        scale: Vec3,
        camera: &dyn Camera3d,
        data: &ObjectData3d,
    ) -> Vec<f32> {
        let (view, projection) = camera.view_transform_pair(0);
        let turned = Pose3::from_parts(Vec3::ZERO, pose.rotation).to_mat4();
        let point = |v: Vec3| [v.x, v.y, v.z, 0.0];
        let (colour, emitted) = (data.color(), data.emissive());
        let [fog_begin, fog_end] = FOG_M.map(|m| m * UNITS_PER_M);
        let wall = wall();
        let mut numbers = Vec::with_capacity(NUMBERS);
        numbers.extend((projection * view.to_mat4()).to_cols_array());
        numbers.extend((pose.to_mat4() * Mat4::from_scale(scale)).to_cols_array());
        numbers.extend((turned * Mat4::from_scale(scale.recip())).to_cols_array());
        numbers.extend(point(camera.eye()));
        numbers.extend([colour.r, colour.g, colour.b, colour.a]);
        numbers.extend([emitted.r, emitted.g, emitted.b, 0.0]);
        numbers.extend([
            data.roughness().clamp(0.05, 1.0),
            data.metallic(),
            WRAP + 0.5 * data.subsurface(),
            0.0,
        ]);
        numbers.extend([data.clearcoat(), data.clearcoat_roughness().clamp(0.05, 1.0)]);
        numbers.extend([fog_begin, 1.0 / (fog_end - fog_begin)]);
        numbers.extend([wall.r, wall.g, wall.b, 0.0]);
        for lamp in [KEY, FILL] {
            numbers.extend(point(-Vec3::from_array(lamp.direction).normalize()));
            let [red, green, blue] = lamp.thrown();
            numbers.extend([red, green, blue, 0.0]);
        }
        if let Some(capsules) = &self.capsules {
            numbers.extend(
                capsules
                    .borrow()
                    .iter()
                    .take(MAX_CAPSULES)
                    .flat_map(|capsule| capsule.scaled(UNITS_PER_M)),
            );
        }
        numbers.resize(NUMBERS, 0.0);
        numbers
    }
}

impl Material3d for PlainMaterial {
    fn create_gpu_data(&self) -> Box<dyn GpuData> {
        let uniforms = Context::get().create_buffer(&wgpu::BufferDescriptor {
            label: Some("plain"),
            size: (NUMBERS * size_of::<f32>()) as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Box::new(PlainData { uniforms, bound: None })
    }

    fn renders_in_transparent_phase(&self) -> bool {
        true
    }

    fn prepare(
        &mut self,
        _pass: usize,
        transform: Pose3,
        scale: Vec3,
        camera: &mut dyn Camera3d,
        _lights: &LightCollection,
        data: &ObjectData3d,
        gpu_data: &mut dyn GpuData,
        _viewport_width: u32,
        _viewport_height: u32,
    ) {
        let Some(own) = gpu_data.as_any_mut().downcast_mut::<PlainData>() else { return };
        let context = Context::get();
        let numbers = self.numbers(transform, scale, camera, data);
        context.write_buffer(&own.uniforms, 0, bytemuck::cast_slice(&numbers));
        let texture = data.texture();
        if own.bound.as_ref().is_some_and(|(of, _)| Arc::ptr_eq(of, texture)) {
            return;
        }
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let group = context.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("plain"),
            layout: &self.bindings,
            entries: &[
                entry(0, own.uniforms.as_entire_binding()),
                entry(1, wgpu::BindingResource::TextureView(&texture.view)),
                entry(2, wgpu::BindingResource::Sampler(&texture.sampler)),
            ],
        });
        own.bound = Some((Arc::clone(texture), group));
    }

    fn render(
        &mut self,
        _pass: usize,
        _transform: Pose3,
        _scale: Vec3,
        _camera: &mut dyn Camera3d,
        _lights: &LightCollection,
        data: &ObjectData3d,
        mesh: &mut GpuMesh3d,
        _instances: &mut InstancesBuffer3d,
        gpu_data: &mut dyn GpuData,
        render_pass: &mut wgpu::RenderPass<'_>,
        context: &RenderContext,
    ) {
        let is_transparent = data.color().a < 1.0;
        let is_due = match context.phase {
            RenderPhase::Opaque => !is_transparent,
            RenderPhase::Transparent => is_transparent,
            RenderPhase::Prepass | RenderPhase::Transmission => false,
        };
        if !is_due || !data.surface_rendering_active() {
            return;
        }
        let Some(own) = gpu_data.as_any().downcast_ref::<PlainData>() else { return };
        let Some((_, group)) = &own.bound else { return };
        let indices = mesh.num_indices();
        let Some((positions, triangles, normals, uvs)) = mesh.ensure_on_gpu() else { return };
        let is_culled = data.backface_culling_enabled() && !context.force_no_cull;
        let way = Way { samples: context.sample_count.max(1), is_culled, is_transparent };
        render_pass.set_pipeline(self.pipeline(way));
        render_pass.set_bind_group(0, group, &[]);
        for (slot, buffer) in (0..).zip([positions, normals, uvs]) {
            render_pass.set_vertex_buffer(slot, buffer.slice(..));
        }
        render_pass.set_index_buffer(triangles.slice(..), VERTEX_INDEX_FORMAT);
        render_pass.draw_indexed(0..indices, 0, 0..1);
    }
}

fn new_pipeline(
    layout: &wgpu::PipelineLayout,
    shader: &wgpu::ShaderModule,
    entry: &str,
    way: Way,
) -> wgpu::RenderPipeline {
    let stream = |attributes, numbers: usize| {
        Some(wgpu::VertexBufferLayout {
            array_stride: (numbers * size_of::<f32>()) as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes,
        })
    };
    Context::get().create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("plain"),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some("vertex"),
            buffers: &[
                stream(&wgpu::vertex_attr_array![0 => Float32x3], 3),
                stream(&wgpu::vertex_attr_array![1 => Float32x3], 3),
                stream(&wgpu::vertex_attr_array![2 => Float32x2], 2),
            ],
            compilation_options: wgpu::PipelineCompilationOptions::default(),
        },
        fragment: Some(wgpu::FragmentState {
            module: shader,
            entry_point: Some(entry),
            targets: &targets(way.is_transparent),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
        }),
        primitive: wgpu::PrimitiveState {
            cull_mode: way.is_culled.then_some(wgpu::Face::Back),
            ..wgpu::PrimitiveState::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: Context::depth_format(),
            depth_write_enabled: Some(!way.is_transparent),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: multisample_state(way.samples),
        multiview_mask: None,
        cache: None,
    })
}

/// Where the colours go: into the picture, or into the sums from which the renderer blends what can
/// be seen through.
fn targets(is_transparent: bool) -> Vec<Option<wgpu::ColorTargetState>> {
    let target = |format, blend| {
        Some(wgpu::ColorTargetState { format, blend, write_mask: wgpu::ColorWrites::ALL })
    };
    if !is_transparent {
        return vec![target(Context::render_format(), None)];
    }
    let blend = |src_factor, dst_factor| {
        let operation = wgpu::BlendOperation::Add;
        let component = wgpu::BlendComponent { src_factor, dst_factor, operation };
        Some(wgpu::BlendState { color: component, alpha: component })
    };
    use wgpu::BlendFactor::{One, OneMinusSrc, Zero};
    vec![
        target(OIT_ACCUM_FORMAT, blend(One, One)),
        target(OIT_REVEAL_FORMAT, blend(Zero, OneMinusSrc)),
    ]
}
