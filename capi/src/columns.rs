//! Columns of the last frame, copied into buffers of the host: all that a renderer of its own needs.
//!
//! In:    a terrain, a view's number, buffers with their capacities.
//! Out:   patches, vertices, where they begin, indices, ranges, eyes, wanted pages, faults.
//! Keeps: nothing.
//! Not here: the frame's numbers (`frame`), drawing.

use crate::border::{Caller, In, answer};
use crate::status::{Fault, OVF_SHORT_BUFFER, ovf_status};
use crate::terrain::{State, ovf_terrain, with};
use bytemuck::Zeroable;
use overfly::core::columns::Id;
use overfly::core::frame::ViewDraws;
use overfly::core::geodesy::TwoFloat;
use overfly::core::lod::diamonds::leaf_key;
use overfly::core::mesh::{PatchMorph, PatchVertex, Patches};
use overfly::core::scene::extract;
use overfly::core::settings::{DepthFormat, DepthOrder};
use std::ffi::c_char;

/// `ovf_limits.depth_format`: floats of 32 bits.
pub const OVF_DEPTH_D32F: u32 = 0;
/// `ovf_limits.depth_format`: whole numbers of 24 bits.
pub const OVF_DEPTH_D24: u32 = 1;

/// `ovf_limits.depth_order`: 1 is nearest; depth is cleared to 0, and what is greater is drawn.
pub const OVF_DEPTH_REVERSED: u32 = 0;
/// `ovf_limits.depth_order`: 0 is nearest; depth is cleared to 1, and what is less is drawn.
pub const OVF_DEPTH_FORWARD: u32 = 1;

/// What stays the same as long as a terrain lives: how large buffers must be, body and depth.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_limits {
    /// `sizeof(ovf_limits)`, set by the host.
    pub struct_size: u32,
    /// A patch is 2^this triangles.
    pub patch_depth: u32,
    /// Most patches; slots are 0 to this, itself excluded.
    pub patches_max: u32,
    /// Vertices of a patch.
    pub vertices_per_patch: u32,
    /// Indices of a patch: three a triangle.
    pub indices_per_patch: u32,
    /// Depth ranges of a view.
    pub ranges_per_view: u32,
    /// Most pages.
    pub pages_max: u32,
    /// Most pages that a frame wants.
    pub wanted_max: u32,
    /// 1: vertices morph, and `ovf_terrain_morphs` has where they begin.
    pub morphs: u32,
    /// How long that takes, in milliseconds of the frames' time.
    pub morph_ms: u32,
    /// Equatorial radius of the body.
    pub body_a_m: f64,
    /// Flattening of the body.
    pub body_f: f64,
    /// 0.
    pub reserved: u64,
    /// `OVF_DEPTH_…`: numbers of the depth buffer that the scene's ranges are made for.
    pub depth_format: u32,
    /// `OVF_DEPTH_…`: which way they run.
    pub depth_order: u32,
}

/// A vertex: 36 bytes, as a GPU may take them. This struct never changes.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_vertex {
    /// Body-fixed position rounded to float. From the eye: two-sum of `hi` with the eye's `-hi`,
    /// then both `lo`.
    pub position_hi_m: [f32; 3],
    /// What `hi` left of it.
    pub position_lo_m: [f32; 3],
    /// Body-fixed normal of the ground, octahedral, ±32767 is ±1.
    pub normal_oct: [i16; 2],
    /// Roughness, rock, moisture, temperature of the ground, 0 to 255: what it is coloured by.
    pub layers: [u8; 4],
    /// Height of the ground above the ellipsoid; below the position where that is on water.
    pub height_m: f32,
}

/// Where a vertex begins: 24 bytes. This struct never changes.
///
/// At a time t a vertex is drawn at its own place plus `from_m` times what is left of its way: 1
/// at its birth, 0 from `morph_ms` later on, linear between; normals and layers are mixed likewise.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_morph {
    /// From its own place to where it begins.
    pub from_m: [f32; 3],
    /// Normal there.
    pub normal_oct: [i16; 2],
    /// Layers there.
    pub layers: [u8; 4],
    /// When it was born, as `ovf_frame.time_ms` counts.
    pub born_ms: u32,
}

const _: () = assert!(size_of::<ovf_vertex>() == size_of::<PatchVertex>());
const _: () = assert!(size_of::<ovf_morph>() == size_of::<PatchMorph>());

/// A depth range of a view. This struct never changes.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_range {
    /// Near border along the view, overlap included.
    pub near_m: f64,
    /// Far border; infinite in the last range.
    pub far_m: f64,
    /// Its first patch among those of the view.
    pub first_patch: u32,
    /// How many patches it has.
    pub patch_count: u32,
}

/// Columns of patches, each with room for all of them; null where the host does not want one.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_patch_columns {
    /// `sizeof(ovf_patch_columns)`.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Slot: its vertices stay until `ovf_terrain_built` lists it again.
    pub slot: *mut u32,
    /// Which leaf triangle: the same one has the same key in every frame and on every machine.
    pub key: *mut u64,
    /// Its level, 0 to 56.
    pub level: *mut u8,
    /// Its depth range, 0 the nearest.
    pub range: *mut u8,
    /// Centres of bounding spheres, body-fixed, three numbers each.
    pub centre_ecef_m: *mut f64,
    /// Radii of bounding spheres.
    pub radius_m: *mut f64,
}

/// What a renderer needs to know of a view's eye.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_eye {
    /// `sizeof(ovf_eye)`, set by the host.
    pub struct_size: u32,
    /// 1: `sun_direction_ecef` has the sun; 0: the ground is lit evenly.
    pub has_sun: u32,
    /// Width of the picture.
    pub width_px: u32,
    /// Height of the picture.
    pub height_px: u32,
    /// The eye, body-fixed.
    pub eye_ecef_m: [f64; 3],
    /// The same rounded to float.
    pub eye_hi_m: [f32; 3],
    /// What `hi` left of it.
    pub eye_lo_m: [f32; 3],
    /// To the right of the picture, length 1.
    pub right_ecef: [f64; 3],
    /// To its top.
    pub up_ecef: [f64; 3],
    /// Into it.
    pub forward_ecef: [f64; 3],
    /// Tangents of half the horizontal and half the vertical field of view.
    pub half_tangents: [f64; 2],
    /// Height of the eye above the ellipsoid.
    pub height_m: f64,
    /// Nothing nearer is drawn.
    pub near_m: f64,
    /// Towards the sun, length 1.
    pub sun_direction_ecef: [f64; 3],
}

/// What a terrain's buffers must hold.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_limits(
    terrain: ovf_terrain,
    limits: *mut ovf_limits,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_out("limits", limits)?;
        let value = with(terrain, |state| Ok(limits_of(state)))?;
        caller.put("limits", limits, value)
    })
}

fn limits_of(state: &State) -> ovf_limits {
    let (terrain, scene) = (state.overfly.terrain(), state.overfly.scene());
    let patches = terrain.patches();
    let count = |n: usize| u32::try_from(n).expect("few");
    #[expect(clippy::cast_possible_truncation, reason = "a few seconds at most")]
    #[expect(clippy::cast_sign_loss, reason = "settings allow no negative time")]
    let morph_ms = (scene.lod.morph_s * 1e3).round() as u32;
    ovf_limits {
        struct_size: 0,
        patch_depth: u32::from(patches.patch_depth),
        patches_max: terrain.limits().leaves,
        vertices_per_patch: patches.vertices_per_patch,
        indices_per_patch: count(state.indices.len()),
        ranges_per_view: count(scene.depth.splits_m.len() + 1),
        pages_max: terrain.limits().pages,
        wanted_max: scene.lod.wanted_max,
        morphs: u32::from(!patches.morphs.is_empty()),
        morph_ms,
        body_a_m: scene.body.a_m,
        body_f: scene.body.f,
        reserved: 0,
        depth_format: match scene.depth.format {
            DepthFormat::D32F => OVF_DEPTH_D32F,
            DepthFormat::D24 => OVF_DEPTH_D24,
        },
        depth_order: match scene.depth.order {
            DepthOrder::Reversed => OVF_DEPTH_REVERSED,
            DepthOrder::Forward => OVF_DEPTH_FORWARD,
        },
    }
}

/// The triangles of every patch: three indices each into its vertices, counter-clockwise from above.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_indices(
    terrain: ovf_terrain,
    indices: *mut u32,
    capacity: u64,
    count: *mut u64,
) -> ovf_status {
    answer!(|caller: &Caller| with(terrain, |state| {
        caller.fill("indices", (indices, capacity, count), state.indices.iter().copied())
    }))
}

/// Slots whose vertices the last frame wrote: what a renderer must copy.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_built(
    terrain: ovf_terrain,
    slots: *mut u32,
    capacity: u64,
    count: *mut u64,
) -> ovf_status {
    answer!(|caller: &Caller| with(terrain, |state| {
        caller.fill("slots", (slots, capacity, count), state.output.built.iter().copied())
    }))
}

/// Vertices of some slots, `vertices_per_patch` each, in the order of `slots`.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_vertices(
    terrain: ovf_terrain,
    slots: *const u32,
    slot_count: u64,
    vertices: *mut ovf_vertex,
    capacity: u64,
) -> ovf_status {
    answer!(|caller: &Caller| with(terrain, |state| {
        let patches = state.overfly.terrain().patches();
        let slots = known_slots(&patches, caller.array("slots", slots, slot_count)?)?;
        let each = patches.vertices_per_patch as usize;
        enough("vertices", slots.count() * each, capacity)?;
        let out = caller.array_out("vertices", vertices, capacity)?;
        for (index, slot) in slots.iter().enumerate() {
            for (at, vertex) in patches.vertices_of(slot).iter().enumerate() {
                out.put(index * each + at, vertex_of(vertex));
            }
        }
        Ok(())
    }))
}

/// Where the vertices of some slots begin, in the order of `ovf_terrain_vertices`. Refused where
/// `ovf_limits.morphs` is 0.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_morphs(
    terrain: ovf_terrain,
    slots: *const u32,
    slot_count: u64,
    morphs: *mut ovf_morph,
    capacity: u64,
) -> ovf_status {
    answer!(|caller: &Caller| with(terrain, |state| {
        let patches = state.overfly.terrain().patches();
        if patches.morphs.is_empty() {
            return Err(Fault::invalid("the scene's lod.morph_s is 0: vertices do not morph"));
        }
        let slots = known_slots(&patches, caller.array("slots", slots, slot_count)?)?;
        let each = patches.vertices_per_patch as usize;
        enough("morphs", slots.count() * each, capacity)?;
        let out = caller.array_out("morphs", morphs, capacity)?;
        for (index, slot) in slots.iter().enumerate() {
            for (at, morph) in patches.morphs_of(slot).iter().enumerate() {
                let PatchMorph { from_m, normal_oct, layers, born_ms } = *morph;
                out.put(index * each + at, ovf_morph { from_m, normal_oct, layers, born_ms });
            }
        }
        Ok(())
    }))
}

fn vertex_of(vertex: &PatchVertex) -> ovf_vertex {
    let PatchVertex { position: TwoFloat { hi, lo }, normal_oct, layers, height_m } = *vertex;
    ovf_vertex { position_hi_m: hi, position_lo_m: lo, normal_oct, layers, height_m }
}

/// Refuses slots that do not exist; free ones are there and hold what was last in them.
fn known_slots<'a>(patches: &Patches, slots: In<'a, u32>) -> Result<In<'a, u32>, Fault> {
    let most = patches.leaf.len();
    let unknown = slots.iter().find(|&slot| slot as usize >= most);
    unknown.map_or(Ok(slots), |slot| {
        Err(Fault::invalid(format!("slots: {slot} is none, allowed is below {most}")))
    })
}

fn enough(name: &str, needed: usize, capacity: u64) -> Result<(), Fault> {
    if needed as u64 <= capacity {
        return Ok(());
    }
    let sentence = format!("{name} has room for {capacity}, needed are {needed}");
    Err(Fault::new(OVF_SHORT_BUFFER, sentence))
}

/// Depth ranges of a view, near to far. A renderer draws them far to near and clears depth between.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_ranges(
    terrain: ovf_terrain,
    view: u32,
    ranges: *mut ovf_range,
    capacity: u64,
    count: *mut u64,
) -> ovf_status {
    answer!(|caller: &Caller| with(terrain, |state| {
        let mut first_patch = 0;
        let list = view_of(state, view)?.ranges.iter().map(|range| {
            let patch_count = u32::try_from(range.patches.len()).expect("fewer than slots");
            let first = first_patch;
            first_patch += patch_count;
            let (near_m, far_m) = (range.near_m, range.far_m);
            ovf_range { near_m, far_m, first_patch: first, patch_count }
        });
        caller.fill("ranges", (ranges, capacity, count), list)
    }))
}

/// What is drawn in a view, range by range, near to far; in a range by slot. A patch that reaches
/// into several ranges is in each. Null columns and a capacity of 0 ask for the number.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_patches(
    terrain: ovf_terrain,
    view: u32,
    columns: *const ovf_patch_columns,
    capacity: u64,
    count: *mut u64,
) -> ovf_status {
    answer!(|caller: &Caller| with(terrain, |state| {
        caller.check_plain("count", count)?;
        let view = view_of(state, view)?;
        let needed: usize = view.ranges.iter().map(|range| range.patches.len()).sum();
        let asks = columns.is_null() && capacity == 0;
        let columns =
            if asks { ovf_patch_columns::zeroed() } else { caller.sized("columns", columns)? };
        caller.put_plain("count", count, needed as u64)?;
        if asks { Ok(()) } else { list_patches(caller, state, view, (&columns, capacity)) }
    }))
}

fn list_patches(
    caller: &Caller,
    state: &State,
    view: &ViewDraws,
    (columns, capacity): (&ovf_patch_columns, u64),
) -> Result<(), Fault> {
    let ranges = || view.ranges.iter().enumerate();
    enough("columns", ranges().map(|(_, range)| range.patches.len()).sum(), capacity)?;
    let slots = caller.column("columns: slot", columns.slot, capacity)?;
    let keys = caller.column("columns: key", columns.key, capacity)?;
    let levels = caller.column("columns: level", columns.level, capacity)?;
    let in_ranges = caller.column("columns: range", columns.range, capacity)?;
    let thrice = capacity.saturating_mul(3);
    let centres = caller.column("columns: centre_ecef_m", columns.centre_ecef_m, thrice)?;
    let radii = caller.column("columns: radius_m", columns.radius_m, capacity)?;
    let terrain = state.overfly.terrain();
    let (lod, patches) = (terrain.lod(), terrain.patches());
    let listed = ranges().flat_map(|(range, draws)| draws.patches.iter().map(move |&s| (range, s)));
    for (at, (range, slot)) in listed.enumerate() {
        let leaf = patches.leaf[slot as usize].expect("what is drawn is live");
        let diamond = &lod.mesh.diamonds[Id::new(leaf.diamond)];
        slots.put(at, slot);
        keys.put(at, leaf_key(diamond.key(), usize::from(leaf.side)));
        levels.put(at, diamond.level());
        in_ranges.put(at, u8::try_from(range).expect("few ranges"));
        let (centre, radius_m) = patches.sphere(slot).expect("what is drawn has bounds");
        centre.to_array().into_iter().enumerate().for_each(|(i, c)| centres.put(3 * at + i, c));
        radii.put(at, radius_m);
    }
    Ok(())
}

/// What a renderer needs to know of a view's eye.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_eye(
    terrain: ovf_terrain,
    view: u32,
    eye: *mut ovf_eye,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_out("eye", eye)?;
        let value = with(terrain, |state| {
            let camera = view_of(state, view)?.camera;
            let time_s = state.time_s;
            let sun = extract(state.overfly.world_mut(), time_s).sun_direction;
            let TwoFloat { hi, lo } = camera.eye.two_float();
            let [width_px, height_px] = camera.size_px;
            Ok(ovf_eye {
                struct_size: 0,
                has_sun: u32::from(sun.is_some()),
                width_px,
                height_px,
                eye_ecef_m: camera.eye.0.to_array(),
                eye_hi_m: hi,
                eye_lo_m: lo,
                right_ecef: camera.right.to_array(),
                up_ecef: camera.up.to_array(),
                forward_ecef: camera.forward.to_array(),
                half_tangents: camera.half_tangents,
                height_m: camera.height_m,
                near_m: camera.near_m,
                sun_direction_ecef: sun.unwrap_or_default().to_array(),
            })
        })?;
        caller.put("eye", eye, value)
    })
}

/// Pages that the last frame lacked, the most urgent first: for `ovf_terrain_load_page`.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_wanted(
    terrain: ovf_terrain,
    keys: *mut u64,
    capacity: u64,
    count: *mut u64,
) -> ovf_status {
    answer!(|caller: &Caller| with(terrain, |state| {
        let wanted = state.output.wanted.iter().map(|key| key.bits());
        caller.fill("keys", (keys, capacity, count), wanted)
    }))
}

/// Why a page that overfly's own threads make failed when it was last tried, as a text: the
/// `index`-th of such pages. `*key` is 0 and the text empty where there are no more.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_fault(
    terrain: ovf_terrain,
    index: u64,
    key: *mut u64,
    text: *mut c_char,
    capacity: u64,
    count: *mut u64,
) -> ovf_status {
    answer!(|caller: &Caller| with(terrain, |state| {
        caller.check_plain("key", key)?;
        let at = usize::try_from(index).unwrap_or(usize::MAX);
        let fault = state.overfly.faults().nth(at);
        let (bits, said) = fault.map_or((0, String::new()), |(page, error)| {
            (page.bits(), Fault::of(crate::status::OVF_PAGE, error).sentence)
        });
        give_text(caller, &said, (text, capacity, count))?;
        caller.put_plain("key", key, bits)
    }))
}

/// The scene as it is now, as the text of a scene file: what an edit may start from.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_scene_text(
    terrain: ovf_terrain,
    text: *mut c_char,
    capacity: u64,
    count: *mut u64,
) -> ovf_status {
    answer!(|caller: &Caller| with(terrain, |state| {
        let written = overfly::config::write(state.overfly.scene());
        let written = written.map_err(|fault| Fault::of(crate::status::OVF_SCENE, &fault))?;
        give_text(caller, &written, (text, capacity, count))
    }))
}

/// Copies a text out, with a NUL at its end, which counts.
fn give_text(
    caller: &Caller,
    text: &str,
    buffer: (*mut c_char, u64, *mut u64),
) -> Result<(), Fault> {
    let bytes: Vec<_> = text.bytes().chain([0]).map(u8::cast_signed).collect();
    let (start, capacity, count) = buffer;
    caller.fill("text", (start.cast::<i8>(), capacity, count), bytes.into_iter())
}

/// A view of the last frame.
pub fn view_of(state: &State, view: u32) -> Result<&ViewDraws, Fault> {
    let count = state.output.views.len();
    state.output.views.get(view as usize).ok_or_else(|| {
        Fault::invalid(format!("view is {view}, allowed is below {count}: those of the last frame"))
    })
}
