/* overfly.h: the terrain backend of a flight simulator, for C11 and C++17.
 *
 * Made by cbindgen from capi/src: change it there. docs/c.md is the page to read first.
 *
 * Handles are numbers, checked at each use: one that was destroyed, twice or by another thread,
 * that is 0 or was never given out ends a call with OVF_STALE.
 *
 * Pointers. Each is null or good until the call returns, for as many elements as the function says,
 * aligned for its type, and nobody else writes there meanwhile. Texts are UTF-8 with a NUL at their
 * end. Null is answered with OVF_NULL_POINTER where it may not be. Nothing of the host's is kept
 * but the functions and `user` of ovf_host, and what ovf_device and ovf_target name of Vulkan.
 *
 * Structs that begin with struct_size want sizeof there, also where they are only written: later
 * versions append fields, and take the shorter structs of older programs. Set all of a struct to 0
 * first: 0 is what fields that you do not know yet shall be. Structs without it never change.
 *
 * Numbers carry their unit in their name. ECEF is body-fixed: x to latitude and longitude 0, z to
 * the north pole. Heights are above the ellipsoid unless a name says otherwise.
 *
 * Threads. Calls on one terrain are for one thread at a time, whichever: another one gets OVF_BUSY
 * and does not wait. So are calls on one renderer, but that ovf_renderer_record_range and
 * _record_overlay may be in several; ovf_renderer_record_uploads is a call on the terrain as well.
 * For any thread at any time are ovf_terrain_work, _run_task and _load_page, all of ovf_ground_*,
 * ovf_last_error and ovf_version.
 *
 * Vulkan is the host's: none of it is needed to build or link this, nor to run it without
 * ovf_renderer. What can be looked at is checked; for the rest the host vouches. Its handles are
 * good, belong together and stay until the renderer is destroyed, and so does the library that they
 * are of; a device has finished what was recorded when the renderer is destroyed. Command buffers
 * are of the renderer's queue family and are recorded by no other thread during a call.
 */

#ifndef OVERFLY_H
#define OVERFLY_H

#include <stdint.h>

/**
 * `ovf_edit.changes`: all of the scene is another. It may differ in sources, sea, sun and views.
 */
#define OVF_EDIT_SCENE 1

/**
 * `ovf_edit.changes`: the sun is another, or there is none any more.
 */
#define OVF_EDIT_SUN 2

/**
 * `ovf_edit.changes`: water comes or goes. The terrain begins anew.
 */
#define OVF_EDIT_SEA 4

/**
 * `ovf_edit.sun`: there is none; the ground is lit evenly.
 */
#define OVF_SUN_NONE 0

/**
 * `ovf_edit.sun`: it stands in `sun_direction_ecef`.
 */
#define OVF_SUN_FIXED 1

/**
 * `ovf_edit.sun`: it stands where it does at `sun_start_unix_s`.
 */
#define OVF_SUN_CLOCK_STOPPED 2

/**
 * `ovf_edit.sun`: as that, and goes on with the time of the frames.
 */
#define OVF_SUN_CLOCK 3

/**
 * `ovf_host.workers`: nobody helps the thread that runs a frame; no thread is started.
 */
#define OVF_WORKERS_CALLER 0

/**
 * `ovf_host.workers`: `worker_count` threads of overfly's, which sleep between frames.
 */
#define OVF_WORKERS_OWN 1

/**
 * `ovf_host.workers`: at most `worker_count` threads of the host that are in `ovf_terrain_work`.
 */
#define OVF_WORKERS_LENT 2

/**
 * `ovf_host.workers`: `spawn` is called with `worker_count` tasks a frame.
 */
#define OVF_WORKERS_SPAWNED 3

/**
 * `ovf_host.pages`: threads of overfly's make what a frame lacks; it comes when it is ready.
 */
#define OVF_PAGES_AS_READY 0

/**
 * `ovf_host.pages`: as that, but the next frame waits for it: the same frames on every machine.
 */
#define OVF_PAGES_WAITED 1

/**
 * `ovf_host.pages`: threads of the host call `ovf_terrain_load_page` for what
 * `ovf_terrain_wanted` lists.
 */
#define OVF_PAGES_HOST 2

/**
 * `ovf_view.eye`: where the eye is, is in `eye_ecef_m`.
 */
#define OVF_EYE_ECEF 0

/**
 * `ovf_view.eye`: it is in `eye_lat_rad`, `eye_lon_rad` and `eye_height_m`.
 */
#define OVF_EYE_GEODETIC 1

/**
 * `ovf_view.attitude`: where it looks is in `camera_to_ecef_xyzw`.
 */
#define OVF_ATTITUDE_QUATERNION 0

/**
 * `ovf_view.attitude`: it is in `yaw_rad`, `pitch_rad` and `roll_rad`.
 */
#define OVF_ATTITUDE_ANGLES 1

/**
 * `ovf_limits.depth_format`: floats of 32 bits.
 */
#define OVF_DEPTH_D32F 0

/**
 * `ovf_limits.depth_format`: whole numbers of 24 bits.
 */
#define OVF_DEPTH_D24 1

/**
 * `ovf_limits.depth_order`: 1 is nearest; depth is cleared to 0, and what is greater is drawn.
 */
#define OVF_DEPTH_REVERSED 0

/**
 * `ovf_limits.depth_order`: 0 is nearest; depth is cleared to 1, and what is less is drawn.
 */
#define OVF_DEPTH_FORWARD 1

/**
 * `ovf_overlay_shape.kind`: a line, 1.25 pixels wide.
 */
#define OVF_SHAPE_LINE 0

/**
 * `ovf_overlay_shape.kind`: a filled rectangle.
 */
#define OVF_SHAPE_RECTANGLE 1

/**
 * `ovf_overlay_shape.kind`: text.
 */
#define OVF_SHAPE_TEXT 2

/**
 * `ovf_picture.show`: the ground as one would see it.
 */
#define OVF_SHOW_SHADED 0

/**
 * `ovf_picture.show`: edges of all triangles, those of patches bolder.
 */
#define OVF_SHOW_WIREFRAME 1

/**
 * `ovf_picture.show`: levels of leaves.
 */
#define OVF_SHOW_LEVEL 2

/**
 * `ovf_picture.show`: bound on the error on the screen: white at the tolerance, red from twice on.
 */
#define OVF_SHOW_SCREEN_ERROR 3

/**
 * `ovf_picture.show`: depths of pages; red where a page is lacking.
 */
#define OVF_SHOW_RESIDENCY 4

/**
 * `ovf_picture.show`: normals: east red, north green, up blue.
 */
#define OVF_SHOW_NORMALS 5

/**
 * `ovf_picture.show`: which depth range drew it.
 */
#define OVF_SHOW_DEPTH_RANGE 6

/**
 * `ovf_picture.show`: all patches there are; red those that no view sees.
 */
#define OVF_SHOW_CULLED 7

/**
 * `ovf_picture.backdrop`: the farthest range draws the sky behind the ground.
 */
#define OVF_BACKDROP_SKY 0

/**
 * `ovf_picture.backdrop`: what the host cleared to stays behind the ground.
 */
#define OVF_BACKDROP_HOST 1

/**
 * `ovf_query.kind`: the surface of one level. It depends on the scene, the place and the level
 * alone, whatever else is there: what wheels stand on.
 */
#define OVF_QUERY_EXACT 0

/**
 * `ovf_query.kind`: the finest that is there. It changes as pages come and go.
 */
#define OVF_QUERY_BEST_RESIDENT 1

/**
 * `ovf_query.kind`: that of the coarsest level whose error bound there is at most `bound_max_m`.
 */
#define OVF_QUERY_WITHIN 2

/**
 * An answer: as asked.
 */
#define OVF_ANSWER_OK 1

/**
 * An answer: from the finest level that is there, coarser than asked.
 */
#define OVF_ANSWER_COARSER 2

/**
 * An answer: nothing is there yet. All numbers are NaN.
 */
#define OVF_ANSWER_NOT_READY 3

/**
 * An answer: the place is none (NaN, infinite, beyond a pole). All numbers are NaN.
 */
#define OVF_ANSWER_REFUSED 4

/**
 * `origin`: the procedural planet, or nothing where a scene has none.
 */
#define OVF_ORIGIN_PROCEDURAL 0

/**
 * `origin`: real elevation.
 */
#define OVF_ORIGIN_MEASURED 1

/**
 * `origin`: a void of real elevation, filled.
 */
#define OVF_ORIGIN_FILLED 2

/**
 * `refraction`: a straight line.
 */
#define OVF_REFRACTION_NONE 0

/**
 * `refraction`: as radio, by the 4/3-earth rule.
 */
#define OVF_REFRACTION_FOUR_THIRDS 1

/**
 * How a call ended. Where it is not `OVF_OK`, `ovf_last_error` has a sentence, and nothing was
 * changed or written but where a function says so.
 */
enum ovf_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Done.
   */
  OVF_OK = 0,
  /**
   * A pointer is null that may not be, or is not aligned.
   */
  OVF_NULL_POINTER = 1,
  /**
   * A `struct_size` is none that this library knows.
   */
  OVF_STRUCT_SIZE = 2,
  /**
   * A value is outside its range: NaN, infinite, an unknown constant, text that is not UTF-8.
   */
  OVF_INVALID = 3,
  /**
   * A handle was destroyed, never was, or is of another kind.
   */
  OVF_STALE = 4,
  /**
   * The terrain is in a call of another thread, or of this one further up.
   */
  OVF_BUSY = 5,
  /**
   * A buffer is too short; how much is needed was written to the count.
   */
  OVF_SHORT_BUFFER = 6,
  /**
   * As many as possible are open or held already.
   */
  OVF_FULL = 7,
  /**
   * A scene cannot be read, opened or changed to.
   */
  OVF_SCENE = 8,
  /**
   * The system refused a file or a thread.
   */
  OVF_SYSTEM = 9,
  /**
   * A page cannot be made.
   */
  OVF_PAGE = 10,
  /**
   * A recording cannot be begun or goes no further.
   */
  OVF_RECORDING = 11,
  /**
   * A bug of overfly's. The terrain or renderer that it happened in can only be destroyed.
   */
  OVF_PANIC = 12,
  /**
   * A call of Vulkan failed, or the device cannot draw the ground.
   */
  OVF_VULKAN = 13,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ovf_status ovf_status;
#else
typedef int32_t ovf_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Where a scene comes from: exactly one of the three is not null.
 */
typedef struct ovf_scene {
  /**
   * `sizeof(ovf_scene)`.
   */
  uint32_t struct_size;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * Name of a scene that comes with overfly: "earth", "moon" or "small".
   */
  const char *preset;
  /**
   * Path of a scene file. Relative paths in it lead on from its folder.
   */
  const char *path;
  /**
   * Text of a scene file. Relative paths in it lead on from the current directory.
   */
  const char *text;
} ovf_scene;

/**
 * What a host brings. All zeros but `struct_size`: no helpers, one thread that makes pages as they
 * are wanted, files and servers read by overfly.
 *
 * The functions may be called from any thread until `ovf_terrain_destroy` returns; they must not
 * throw, jump out or call `ovf_terrain_destroy`.
 */
typedef struct ovf_host {
  /**
   * `sizeof(ovf_host)`.
   */
  uint32_t struct_size;
  /**
   * `OVF_WORKERS_…`.
   */
  uint32_t workers;
  /**
   * Threads, seats or tasks, 0 to 64.
   */
  uint32_t worker_count;
  /**
   * `OVF_PAGES_…`.
   */
  uint32_t pages;
  /**
   * Threads of overfly's that make pages, 0 to 64; 0 is 1.
   */
  uint32_t loader_threads;
  /**
   * Longest wait for a server's connection in milliseconds; 0 is 5000.
   */
  uint32_t connect_timeout_ms;
  /**
   * Longest wait for a server's next bytes in milliseconds; 0 is 10000.
   */
  uint32_t read_timeout_ms;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * Goes back to the functions, and is never looked into.
   */
  void *user;
  /**
   * A frame has begun: some thread shall call `ovf_terrain_run_task` with `task`, at once, later
   * or never. What it returns goes to `finish`. Needed with `OVF_WORKERS_SPAWNED`.
   */
  uint64_t (*spawn)(void *user, uint64_t task);
  /**
   * The frame is over; tasks that still wait have nothing to do any more. May be null.
   */
  void (*finish)(void *user, uint64_t spawned);
  /**
   * Reads archives instead of overfly, whatever their locations look like: puts up to
   * `length_bytes` bytes from `offset_bytes` on into `buffer` and returns how many, fewer only
   * at the archive's end, or a negative number where it fails. Called from threads that make
   * pages and from `ovf_terrain_new_v1`, several at once; may block. May be null.
   */
  int64_t (*read)(void *user,
                  const char *location,
                  uint64_t offset_bytes,
                  uint64_t length_bytes,
                  uint8_t *buffer);
} ovf_host;

/**
 * A terrain: a scene that runs. A number and no pointer: it may be copied, and one that was
 * destroyed, or never was, is refused. All zeros name none.
 */
typedef struct ovf_terrain {
  /**
   * Not for the host.
   */
  uint64_t bits;
} ovf_terrain;

/**
 * One view of a frame. What the eye's and the attitude's kind do not name is not read.
 */
typedef struct ovf_view {
  /**
   * `sizeof(ovf_view)`.
   */
  uint32_t struct_size;
  /**
   * `OVF_EYE_…`.
   */
  uint32_t eye;
  /**
   * `OVF_ATTITUDE_…`.
   */
  uint32_t attitude;
  /**
   * Width of the picture in pixels, at least 1.
   */
  uint32_t width_px;
  /**
   * Height of the picture in pixels, at least 1.
   */
  uint32_t height_px;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * Body-fixed coordinates of the eye.
   */
  double eye_ecef_m[3];
  /**
   * Turns camera axes (x right, y up, z backward) into body-fixed ones; of any length but 0.
   */
  double camera_to_ecef_xyzw[4];
  /**
   * Geodetic latitude, within ±π/2.
   */
  double eye_lat_rad;
  /**
   * Longitude, east positive.
   */
  double eye_lon_rad;
  /**
   * Height above the ellipsoid, not above sea level.
   */
  double eye_height_m;
  /**
   * Heading of the camera, clockwise from north.
   */
  double yaw_rad;
  /**
   * Up from the horizon.
   */
  double pitch_rad;
  /**
   * Right wing down.
   */
  double roll_rad;
  /**
   * Vertical field of view, 1e-6 to π, π excluded.
   */
  double field_of_view_rad;
  /**
   * Nothing nearer is drawn; at least 1e-6.
   */
  double near_m;
} ovf_view;

/**
 * What becomes another with a frame. Edits are part of what is recorded.
 */
typedef struct ovf_edit {
  /**
   * `sizeof(ovf_edit)`.
   */
  uint32_t struct_size;
  /**
   * Sum of `OVF_EDIT_…`; what is not named stays as it is.
   */
  uint32_t changes;
  /**
   * The scene; read with `OVF_EDIT_SCENE` only. Sun and sea are changed after that.
   */
  const struct ovf_scene *scene;
  /**
   * `OVF_SUN_…`; read with `OVF_EDIT_SUN` only, as what follows.
   */
  uint32_t sun;
  /**
   * 1: water covers the ground below sea level; 0: it does not. Read with `OVF_EDIT_SEA` only.
   */
  uint32_t sea;
  /**
   * Body-fixed direction towards the sun, of any length but 0.
   */
  double sun_direction_ecef[3];
  /**
   * UTC at the frames' time 0, in seconds since 1970 without leap seconds.
   */
  double sun_start_unix_s;
  /**
   * 0.
   */
  uint64_t reserved;
} ovf_edit;

/**
 * What goes into a frame.
 */
typedef struct ovf_frame_input {
  /**
   * `sizeof(ovf_frame_input)`.
   */
  uint32_t struct_size;
  /**
   * How many views there are, 0 to 64.
   */
  uint32_t view_count;
  /**
   * The views, the most important first. All say the same `struct_size`.
   */
  const struct ovf_view *views;
  /**
   * Time of the flight.
   */
  double time_s;
  /**
   * 1: the mesh stays as it is, and only what is drawn follows the views.
   */
  uint32_t hold_lod;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * What becomes another with this frame; null for nothing.
   */
  const struct ovf_edit *edit;
} ovf_frame_input;

/**
 * What a frame ended in. Counts repeat exactly; the digest is that of overfly's other borders.
 */
typedef struct ovf_frame {
  /**
   * `sizeof(ovf_frame)`, set by the host.
   */
  uint32_t struct_size;
  /**
   * What morphing vertices count from, in milliseconds modulo 2^32.
   */
  uint32_t time_ms;
  /**
   * Frames run before this one, since the terrain began (anew).
   */
  uint64_t frame;
  /**
   * One number for the whole state.
   */
  uint64_t digest;
  /**
   * The state's parts: pages, mesh, vertices, draws.
   */
  uint64_t digest_parts[4];
  /**
   * Bound on the error on the screen, in pixels.
   */
  double error_px_bound;
  /**
   * Leaf triangles of the mesh.
   */
  uint32_t leaves;
  /**
   * Triangles of all patches.
   */
  uint32_t triangles;
  /**
   * Splits done.
   */
  uint32_t splits;
  /**
   * Merges done.
   */
  uint32_t merges;
  /**
   * Splits that waited for a page.
   */
  uint32_t blocked;
  /**
   * Resident pages.
   */
  uint32_t pages;
  /**
   * Pages that came in.
   */
  uint32_t admitted;
  /**
   * Pages that went.
   */
  uint32_t evicted;
  /**
   * Pages that came and were not taken.
   */
  uint32_t refused;
  /**
   * Pages that are wanted: what `ovf_terrain_wanted` lists.
   */
  uint32_t wanted;
  /**
   * Patches whose vertices are new: what `ovf_terrain_built` lists.
   */
  uint32_t built;
  /**
   * Patches drawn, summed over views and depth ranges.
   */
  uint32_t drawn;
} ovf_frame;

/**
 * What stays the same as long as a terrain lives: how large buffers must be, body and depth.
 */
typedef struct ovf_limits {
  /**
   * `sizeof(ovf_limits)`, set by the host.
   */
  uint32_t struct_size;
  /**
   * A patch is 2^this triangles.
   */
  uint32_t patch_depth;
  /**
   * Most patches; slots are 0 to this, itself excluded.
   */
  uint32_t patches_max;
  /**
   * Vertices of a patch.
   */
  uint32_t vertices_per_patch;
  /**
   * Indices of a patch: three a triangle.
   */
  uint32_t indices_per_patch;
  /**
   * Depth ranges of a view.
   */
  uint32_t ranges_per_view;
  /**
   * Most pages.
   */
  uint32_t pages_max;
  /**
   * Most pages that a frame wants.
   */
  uint32_t wanted_max;
  /**
   * 1: vertices morph, and `ovf_terrain_morphs` has where they begin.
   */
  uint32_t morphs;
  /**
   * How long that takes, in milliseconds of the frames' time.
   */
  uint32_t morph_ms;
  /**
   * Equatorial radius of the body.
   */
  double body_a_m;
  /**
   * Flattening of the body.
   */
  double body_f;
  /**
   * 0.
   */
  uint64_t reserved;
  /**
   * `OVF_DEPTH_…`: numbers of the depth buffer that the scene's ranges are made for.
   */
  uint32_t depth_format;
  /**
   * `OVF_DEPTH_…`: which way they run.
   */
  uint32_t depth_order;
} ovf_limits;

/**
 * A vertex: 36 bytes, as a GPU may take them. This struct never changes.
 */
typedef struct ovf_vertex {
  /**
   * Body-fixed position rounded to float. From the eye: two-sum of `hi` with the eye's `-hi`,
   * then both `lo`.
   */
  float position_hi_m[3];
  /**
   * What `hi` left of it.
   */
  float position_lo_m[3];
  /**
   * Body-fixed normal of the ground, octahedral, ±32767 is ±1.
   */
  int16_t normal_oct[2];
  /**
   * Roughness, rock, moisture, temperature of the ground, 0 to 255: what it is coloured by.
   */
  uint8_t layers[4];
  /**
   * Height of the ground above the ellipsoid; below the position where that is on water.
   */
  float height_m;
} ovf_vertex;

/**
 * Where a vertex begins: 24 bytes. This struct never changes.
 *
 * At a time t a vertex is drawn at its own place plus `from_m` times what is left of its way: 1
 * at its birth, 0 from `morph_ms` later on, linear between; normals and layers are mixed likewise.
 */
typedef struct ovf_morph {
  /**
   * From its own place to where it begins.
   */
  float from_m[3];
  /**
   * Normal there.
   */
  int16_t normal_oct[2];
  /**
   * Layers there.
   */
  uint8_t layers[4];
  /**
   * When it was born, as `ovf_frame.time_ms` counts.
   */
  uint32_t born_ms;
} ovf_morph;

/**
 * A depth range of a view. This struct never changes.
 */
typedef struct ovf_range {
  /**
   * Near border along the view, overlap included.
   */
  double near_m;
  /**
   * Far border; infinite in the last range.
   */
  double far_m;
  /**
   * Its first patch among those of the view.
   */
  uint32_t first_patch;
  /**
   * How many patches it has.
   */
  uint32_t patch_count;
} ovf_range;

/**
 * Columns of patches, each with room for all of them; null where the host does not want one.
 */
typedef struct ovf_patch_columns {
  /**
   * `sizeof(ovf_patch_columns)`.
   */
  uint32_t struct_size;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * Slot: its vertices stay until `ovf_terrain_built` lists it again.
   */
  uint32_t *slot;
  /**
   * Which leaf triangle: the same one has the same key in every frame and on every machine.
   */
  uint64_t *key;
  /**
   * Its level, 0 to 56.
   */
  uint8_t *level;
  /**
   * Its depth range, 0 the nearest.
   */
  uint8_t *range;
  /**
   * Centres of bounding spheres, body-fixed, three numbers each.
   */
  double *centre_ecef_m;
  /**
   * Radii of bounding spheres.
   */
  double *radius_m;
} ovf_patch_columns;

/**
 * What a renderer needs to know of a view's eye.
 */
typedef struct ovf_eye {
  /**
   * `sizeof(ovf_eye)`, set by the host.
   */
  uint32_t struct_size;
  /**
   * 1: `sun_direction_ecef` has the sun; 0: the ground is lit evenly.
   */
  uint32_t has_sun;
  /**
   * Width of the picture.
   */
  uint32_t width_px;
  /**
   * Height of the picture.
   */
  uint32_t height_px;
  /**
   * The eye, body-fixed.
   */
  double eye_ecef_m[3];
  /**
   * The same rounded to float.
   */
  float eye_hi_m[3];
  /**
   * What `hi` left of it.
   */
  float eye_lo_m[3];
  /**
   * To the right of the picture, length 1.
   */
  double right_ecef[3];
  /**
   * To its top.
   */
  double up_ecef[3];
  /**
   * Into it.
   */
  double forward_ecef[3];
  /**
   * Tangents of half the horizontal and half the vertical field of view.
   */
  double half_tangents[2];
  /**
   * Height of the eye above the ellipsoid.
   */
  double height_m;
  /**
   * Nothing nearer is drawn.
   */
  double near_m;
  /**
   * Towards the sun, length 1.
   */
  double sun_direction_ecef[3];
} ovf_eye;

/**
 * What a renderer is made for, beside its terrain.
 */
typedef struct ovf_renderer_settings {
  /**
   * `sizeof(ovf_renderer_settings)`.
   */
  uint32_t struct_size;
  /**
   * Frames that the device may be behind, 1 to 16; 0 is 2. A host that shows several views takes
   * as many for each.
   */
  uint32_t frames_in_flight;
} ovf_renderer_settings;

/**
 * A Vulkan device of the host, which stays the host's. Handles are cast to pointers; nothing of
 * Vulkan is looked for but through `get_instance_proc_addr`.
 */
typedef struct ovf_device {
  /**
   * `sizeof(ovf_device)`.
   */
  uint32_t struct_size;
  /**
   * Family of `queue`, which draws and computes. What is recorded is submitted to it.
   */
  uint32_t queue_family;
  /**
   * `VkApplicationInfo::apiVersion` of the instance, at least that of Vulkan 1.1.
   */
  uint32_t api_version;
  /**
   * 1: the instance has `VK_EXT_debug_utils`, and objects are named; 0: it has not.
   */
  uint32_t debug_utils;
  /**
   * 1: the device was made with `multiDrawIndirect`, which is needed.
   */
  uint32_t multi_draw_indirect;
  /**
   * 1: it was made with `samplerAnisotropy`: the ground's texture is sharper far off; 0: not.
   */
  uint32_t sampler_anisotropy;
  /**
   * `vkGetInstanceProcAddr`, cast to `void (*)(void)`.
   */
  void (*get_instance_proc_addr)(void);
  /**
   * `VkInstance`.
   */
  void *instance;
  /**
   * `VkPhysicalDevice`.
   */
  void *physical_device;
  /**
   * `VkDevice`.
   */
  void *device;
  /**
   * `VkQueue`, used by `ovf_renderer_new_v1` and at no other time.
   */
  void *queue;
} ovf_device;

/**
 * Where the host draws: a subpass with one colour attachment and depth, without multiview.
 *
 * What is drawn is linear light: the colour has an sRGB format or floats. Any pass will do later
 * that is compatible with this one.
 */
typedef struct ovf_target {
  /**
   * `sizeof(ovf_target)`.
   */
  uint32_t struct_size;
  /**
   * Which subpass.
   */
  uint32_t subpass;
  /**
   * `VkRenderPass`, cast; stays until the renderer is destroyed.
   */
  uint64_t render_pass;
  /**
   * `VkFormat` of the colour attachment.
   */
  uint32_t colour_format;
  /**
   * `VkFormat` of the depth attachment, as `ovf_limits.depth_format` has it, with stencil or
   * without: `VK_FORMAT_D32_SFLOAT…` for `OVF_DEPTH_D32F`, those of 24 bits for `OVF_DEPTH_D24`.
   */
  uint32_t depth_format;
  /**
   * `VkSampleCountFlagBits` of both.
   */
  uint32_t samples;
  /**
   * 0.
   */
  uint32_t reserved;
} ovf_target;

/**
 * What draws a terrain into command buffers of the host. A number, as `ovf_terrain` is.
 */
typedef struct ovf_renderer {
  /**
   * Not for the host.
   */
  uint64_t bits;
} ovf_renderer;

/**
 * Device memory of a renderer.
 */
typedef struct ovf_device_memory {
  /**
   * `sizeof(ovf_device_memory)`, set by the host.
   */
  uint32_t struct_size;
  /**
   * Buffers and images.
   */
  uint32_t allocations;
  /**
   * Bytes of all of them.
   */
  uint64_t bytes;
} ovf_device_memory;

/**
 * Where a host records: one of its command buffers, for one of its frames in flight.
 */
typedef struct ovf_host_frame {
  /**
   * `sizeof(ovf_host_frame)`.
   */
  uint32_t struct_size;
  /**
   * Which frame in flight, below `ovf_renderer_settings.frames_in_flight`. A host that shows
   * several views takes another one for each.
   */
  uint32_t index;
  /**
   * `VkCommandBuffer`, primary or secondary, which is being recorded.
   */
  void *command_buffer;
} ovf_host_frame;

/**
 * A shape on a picture. Pixels go right and down from the picture's top left corner.
 */
typedef struct ovf_overlay_shape {
  /**
   * `sizeof(ovf_overlay_shape)`.
   */
  uint32_t struct_size;
  /**
   * `OVF_SHAPE_…`.
   */
  uint32_t kind;
  /**
   * One end of a line; the top left corner of a rectangle or text; within 1e6 pixels.
   */
  float at_px[2];
  /**
   * The other end of a line; nobody reads it elsewhere.
   */
  float to_px[2];
  /**
   * Width and height of a rectangle, 0 to 1e6; nobody reads it elsewhere.
   */
  float size_px[2];
  /**
   * Red, green, blue with the sRGB curve; opacity.
   */
  uint8_t srgba[4];
  /**
   * Of text: its letters stand in cells of 8 by 8 pixels times this, above 0 up to 1000.
   */
  float scale;
  /**
   * Of text: Latin letters in UTF-8; a line feed begins a line. What the font lacks is a question
   * mark.
   */
  const char *text;
} ovf_overlay_shape;

/**
 * A line in the scene.
 */
typedef struct ovf_overlay_segment {
  /**
   * `sizeof(ovf_overlay_segment)`.
   */
  uint32_t struct_size;
  /**
   * Red, green, blue with the sRGB curve; opacity.
   */
  uint8_t srgba[4];
  /**
   * One end, within 1e12 m.
   */
  double a_ecef_m[3];
  /**
   * The other one.
   */
  double b_ecef_m[3];
} ovf_overlay_segment;

/**
 * What is drawn over a picture: first the segments, then the shapes, each in order. None of it is
 * hidden by the ground. What goes beyond 65 536 triangles is not drawn: lines and rectangles are two
 * each, a letter some forty.
 */
typedef struct ovf_overlay {
  /**
   * `sizeof(ovf_overlay)`.
   */
  uint32_t struct_size;
  /**
   * How many shapes, at most 32 768.
   */
  uint32_t shape_count;
  /**
   * They; may be null where there are none.
   */
  const struct ovf_overlay_shape *shapes;
  /**
   * How many segments, at most 32 768.
   */
  uint32_t segment_count;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * They; may be null where there are none.
   */
  const struct ovf_overlay_segment *segments;
} ovf_overlay;

/**
 * What a picture shows.
 */
typedef struct ovf_picture {
  /**
   * `sizeof(ovf_picture)`.
   */
  uint32_t struct_size;
  /**
   * Which view of the terrain's last frame.
   */
  uint32_t view;
  /**
   * `OVF_SHOW_…`.
   */
  uint32_t show;
  /**
   * `OVF_BACKDROP_…`.
   */
  uint32_t backdrop;
  /**
   * What `ovf_renderer_record_overlay` draws over it; null is nothing. Read during the call.
   */
  const struct ovf_overlay *overlay;
} ovf_picture;

/**
 * How much work a picture is.
 */
typedef struct ovf_draw_report {
  /**
   * `sizeof(ovf_draw_report)`, set by the host.
   */
  uint32_t struct_size;
  /**
   * Patches copied to the device.
   */
  uint32_t uploaded_patches;
  /**
   * The same in bytes.
   */
  uint64_t uploaded_bytes;
  /**
   * Patches drawn, summed over depth ranges.
   */
  uint32_t draws;
  /**
   * Indirect draw commands that draw them.
   */
  uint32_t commands;
  /**
   * Triangles of all draws.
   */
  uint64_t triangles;
  /**
   * Pipelines made so far.
   */
  uint32_t pipelines;
  /**
   * Depth ranges to record.
   */
  uint32_t ranges;
} ovf_draw_report;

/**
 * A snapshot of the ground: it never changes, and answers any thread without a lock and, from a
 * thread's second call on, without memory. It outlives its terrain. A number, as `ovf_terrain` is.
 */
typedef struct ovf_ground {
  /**
   * Not for the host.
   */
  uint64_t bits;
} ovf_ground;

/**
 * Which surface is asked.
 */
typedef struct ovf_query {
  /**
   * `sizeof(ovf_query)`.
   */
  uint32_t struct_size;
  /**
   * `OVF_QUERY_…`.
   */
  uint32_t kind;
  /**
   * Level, 0 to 56: triangles of two levels more have sides half as long. Read with
   * `OVF_QUERY_EXACT` only.
   */
  uint32_t level;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * 0 or more; read with `OVF_QUERY_WITHIN` only.
   */
  double bound_max_m;
} ovf_query;

/**
 * The ground at one place.
 */
typedef struct ovf_height {
  /**
   * `sizeof(ovf_height)`, set by the host.
   */
  uint32_t struct_size;
  /**
   * `OVF_ANSWER_…`.
   */
  uint32_t answer;
  /**
   * Height of the surface above the ellipsoid; water where there is a sea.
   */
  double height_m;
  /**
   * Height of sea level above the ellipsoid: heights above the sea are the difference.
   */
  double sea_level_m;
  /**
   * Normal of the surface, body-fixed, outward, of length 1.
   */
  double normal_ecef[3];
  /**
   * No finer level, and not the ground itself, is farther than this from `height_m`.
   */
  double bound_m;
  /**
   * Level that answered.
   */
  uint32_t level;
  /**
   * `OVF_ORIGIN_…`.
   */
  uint32_t origin;
  /**
   * 1: the surface is water.
   */
  uint32_t water;
  /**
   * 0.
   */
  uint32_t reserved;
} ovf_height;

/**
 * Places: one of the two pairs is not null.
 */
typedef struct ovf_places {
  /**
   * `sizeof(ovf_places)`.
   */
  uint32_t struct_size;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * Geodetic latitudes, within ±π/2.
   */
  const double *lat_rad;
  /**
   * Longitudes, east positive.
   */
  const double *lon_rad;
  /**
   * Geodetic latitudes, within ±90.
   */
  const double *lat_deg;
  /**
   * Longitudes, east positive.
   */
  const double *lon_deg;
} ovf_places;

/**
 * Columns of heights, each with room for all places; null where the host does not want one.
 */
typedef struct ovf_height_columns {
  /**
   * `sizeof(ovf_height_columns)`.
   */
  uint32_t struct_size;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * `OVF_ANSWER_…`.
   */
  uint8_t *answer;
  /**
   * As in `ovf_height`.
   */
  double *height_m;
  /**
   * As in `ovf_height`.
   */
  double *sea_level_m;
  /**
   * As in `ovf_height`, three numbers each.
   */
  double *normal_ecef;
  /**
   * As in `ovf_height`.
   */
  double *bound_m;
  /**
   * As in `ovf_height`.
   */
  uint8_t *level;
  /**
   * As in `ovf_height`.
   */
  uint8_t *origin;
  /**
   * As in `ovf_height`.
   */
  uint8_t *water;
} ovf_height_columns;

/**
 * The ground on the vertical of a point, as flight models ask for it. It does not move.
 */
typedef struct ovf_contact {
  /**
   * `sizeof(ovf_contact)`, set by the host.
   */
  uint32_t struct_size;
  /**
   * `OVF_ANSWER_…`.
   */
  uint32_t answer;
  /**
   * Height of the point above the surface along the vertical; negative under ground.
   */
  double agl_m;
  /**
   * Where the vertical meets the surface.
   */
  double contact_ecef_m[3];
  /**
   * Normal of the surface there, outward, of length 1.
   */
  double normal_ecef[3];
  /**
   * Height of the surface above the ellipsoid.
   */
  double height_m;
  /**
   * Height of sea level above the ellipsoid.
   */
  double sea_level_m;
  /**
   * No finer level, and not the ground itself, is farther than this from `height_m`.
   */
  double bound_m;
  /**
   * Level that answered.
   */
  uint32_t level;
  /**
   * `OVF_ORIGIN_…`.
   */
  uint32_t origin;
  /**
   * 1: the surface is water.
   */
  uint32_t water;
  /**
   * 0.
   */
  uint32_t reserved;
} ovf_contact;

/**
 * Where a ray first meets the ground.
 */
typedef struct ovf_hit {
  /**
   * `sizeof(ovf_hit)`, set by the host.
   */
  uint32_t struct_size;
  /**
   * `OVF_ANSWER_…`.
   */
  uint32_t answer;
  /**
   * 1: it meets it; 0: it does not, and the numbers are NaN.
   */
  uint32_t hit;
  /**
   * Level of the triangle.
   */
  uint32_t level;
  /**
   * Way along the ray; 0 for an origin under ground.
   */
  double distance_m;
  /**
   * The place.
   */
  double point_ecef_m[3];
  /**
   * Normal there, outward, of length 1.
   */
  double normal_ecef[3];
} ovf_hit;

/**
 * What lies between two points.
 */
typedef struct ovf_sight {
  /**
   * `sizeof(ovf_sight)`, set by the host.
   */
  uint32_t struct_size;
  /**
   * `OVF_ANSWER_…`.
   */
  uint32_t answer;
  /**
   * 1: ground.
   */
  uint32_t blocked;
  /**
   * Level of the first triangle of it.
   */
  uint32_t level;
  /**
   * Least height of the line above the surface; NaN where it is blocked.
   */
  double clearance_m;
  /**
   * Way from the first point to the first ground; NaN where it is not blocked, as what follows.
   */
  double distance_m;
  /**
   * The place.
   */
  double point_ecef_m[3];
  /**
   * Normal there, outward, of length 1.
   */
  double normal_ecef[3];
} ovf_sight;

/**
 * All places within a radius along the ellipsoid.
 */
typedef struct ovf_region {
  /**
   * `sizeof(ovf_region)`.
   */
  uint32_t struct_size;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * Geodetic latitude of the middle, within ±π/2.
   */
  double centre_lat_rad;
  /**
   * Its longitude, east positive.
   */
  double centre_lon_rad;
  /**
   * 0 or more.
   */
  double radius_m;
} ovf_region;

/**
 * How much of what a level needs in a region is there.
 */
typedef struct ovf_readiness {
  /**
   * `sizeof(ovf_readiness)`, set by the host.
   */
  uint32_t struct_size;
  /**
   * Pages that are not there.
   */
  uint32_t missing;
  /**
   * Share that is there, 0 to 1.
   */
  double fraction;
  /**
   * 1: `worst_level` is one; 0: somewhere there is nothing at all.
   */
  uint32_t has_level;
  /**
   * The coarsest level that some place has to do with.
   */
  uint32_t worst_level;
} ovf_readiness;

/**
 * Bounds on the ground of a region.
 */
typedef struct ovf_min_max {
  /**
   * `sizeof(ovf_min_max)`, set by the host.
   */
  uint32_t struct_size;
  /**
   * `OVF_ANSWER_…`.
   */
  uint32_t answer;
  /**
   * The ground is nowhere lower above the ellipsoid.
   */
  double low_m;
  /**
   * Nor higher.
   */
  double high_m;
  /**
   * Level of the coarsest pages that had to answer.
   */
  uint32_t level;
  /**
   * 0.
   */
  uint32_t reserved;
} ovf_min_max;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * What went wrong in this thread's last call that failed, as one sentence in UTF-8, at most 4095
 * bytes; empty where none did. Calls that succeed leave it. It stays until the thread's next
 * failing call or its end; never null.
 */
const char *ovf_last_error(void);

/**
 * Opens a scene. `host` may be null. Blocks where an archive is on a server.
 *
 * The 1 in its name is the version of this border: a library with another one lacks the symbol,
 * and the program does not start instead of going wrong.
 */
ovf_status ovf_terrain_new_v1(const struct ovf_scene *scene,
                              const struct ovf_host *host,
                              struct ovf_terrain *terrain);

/**
 * Ends a terrain: its threads end, a recording is left as it is, snapshots of its ground stay. Waits
 * for reads that are under way. No function of the host is called after it returns, but `read` by a
 * thread of the host that is in `ovf_terrain_load_page`.
 */
ovf_status ovf_terrain_destroy(struct ovf_terrain terrain);

/**
 * Lends the calling thread to the frame that runs now, until it ends. For any thread;
 * `*helped` is 1 where it had work, 0 at once where there is no frame, or no seat: then the host
 * does something else first.
 */
ovf_status ovf_terrain_work(struct ovf_terrain terrain, uint32_t *helped);

/**
 * Runs a task that `spawn` was given. For any thread. Does nothing where the task was run already
 * or its frame is over.
 */
ovf_status ovf_terrain_run_task(struct ovf_terrain terrain, uint64_t task);

/**
 * Makes a page on the calling thread, for the next frame. For any thread, several at once, also
 * while a frame runs; blocks while archives are read. For `OVF_PAGES_HOST`; `key` is one that
 * `ovf_terrain_wanted` gave. Some 2 ms of work where nothing has to be waited for.
 *
 * A page that fails may be tried again; until then the ground there stays coarser.
 */
ovf_status ovf_terrain_load_page(struct ovf_terrain terrain, uint64_t key);

/**
 * Runs a frame. `frame` may be null. What is refused leaves the terrain as it was, but
 * `OVF_RECORDING`: the frame was run and is not in the recording.
 */
ovf_status ovf_terrain_frame(struct ovf_terrain terrain,
                             const struct ovf_frame_input *input,
                             struct ovf_frame *frame);

/**
 * The numbers of the last frame again; all 0 before the first.
 */
ovf_status ovf_terrain_last_frame(struct ovf_terrain terrain, struct ovf_frame *frame);

/**
 * What a terrain's buffers must hold.
 */
ovf_status ovf_terrain_limits(struct ovf_terrain terrain, struct ovf_limits *limits);

/**
 * The triangles of every patch: three indices each into its vertices, counter-clockwise from above.
 */
ovf_status ovf_terrain_indices(struct ovf_terrain terrain,
                               uint32_t *indices,
                               uint64_t capacity,
                               uint64_t *count);

/**
 * Slots whose vertices the last frame wrote: what a renderer must copy.
 */
ovf_status ovf_terrain_built(struct ovf_terrain terrain,
                             uint32_t *slots,
                             uint64_t capacity,
                             uint64_t *count);

/**
 * Vertices of some slots, `vertices_per_patch` each, in the order of `slots`.
 */
ovf_status ovf_terrain_vertices(struct ovf_terrain terrain,
                                const uint32_t *slots,
                                uint64_t slot_count,
                                struct ovf_vertex *vertices,
                                uint64_t capacity);

/**
 * Where the vertices of some slots begin, in the order of `ovf_terrain_vertices`. Refused where
 * `ovf_limits.morphs` is 0.
 */
ovf_status ovf_terrain_morphs(struct ovf_terrain terrain,
                              const uint32_t *slots,
                              uint64_t slot_count,
                              struct ovf_morph *morphs,
                              uint64_t capacity);

/**
 * Depth ranges of a view, near to far. A renderer draws them far to near and clears depth between.
 */
ovf_status ovf_terrain_ranges(struct ovf_terrain terrain,
                              uint32_t view,
                              struct ovf_range *ranges,
                              uint64_t capacity,
                              uint64_t *count);

/**
 * What is drawn in a view, range by range, near to far; in a range by slot. A patch that reaches
 * into several ranges is in each. Null columns and a capacity of 0 ask for the number.
 */
ovf_status ovf_terrain_patches(struct ovf_terrain terrain,
                               uint32_t view,
                               const struct ovf_patch_columns *columns,
                               uint64_t capacity,
                               uint64_t *count);

/**
 * What a renderer needs to know of a view's eye.
 */
ovf_status ovf_terrain_eye(struct ovf_terrain terrain, uint32_t view, struct ovf_eye *eye);

/**
 * Pages that the last frame lacked, the most urgent first: for `ovf_terrain_load_page`.
 */
ovf_status ovf_terrain_wanted(struct ovf_terrain terrain,
                              uint64_t *keys,
                              uint64_t capacity,
                              uint64_t *count);

/**
 * Why a page that overfly's own threads make failed when it was last tried, as a text: the
 * `index`-th of such pages. `*key` is 0 and the text empty where there are no more.
 */
ovf_status ovf_terrain_fault(struct ovf_terrain terrain,
                             uint64_t index,
                             uint64_t *key,
                             char *text,
                             uint64_t capacity,
                             uint64_t *count);

/**
 * The scene as it is now, as the text of a scene file: what an edit may start from.
 */
ovf_status ovf_terrain_scene_text(struct ovf_terrain terrain,
                                  char *text,
                                  uint64_t capacity,
                                  uint64_t *count);

/**
 * Makes a renderer of a terrain: takes memory on the host's device, makes pipelines, copies what
 * never changes and tests the driver's arithmetic. Submits to the queue and waits; nobody else uses
 * the queue meanwhile. Other calls on the terrain may go on. `settings` may be null.
 *
 * The 1 in its name is the version of this border, as in `ovf_terrain_new_v1`.
 */
ovf_status ovf_renderer_new_v1(struct ovf_terrain terrain,
                               const struct ovf_renderer_settings *settings,
                               const struct ovf_device *device,
                               const struct ovf_target *target,
                               struct ovf_renderer *renderer);

/**
 * Ends a renderer, whose terrain may be gone already: gives all back that it took of the device,
 * which has finished whatever was recorded. To be called before the host destroys the device.
 */
ovf_status ovf_renderer_destroy(struct ovf_renderer renderer);

/**
 * Tells that a command buffer with uploads was thrown away instead of submitted: all of the ground
 * is uploaded again.
 */
ovf_status ovf_renderer_note_lost(struct ovf_renderer renderer);

/**
 * Device memory that a renderer takes now.
 */
ovf_status ovf_renderer_memory(struct ovf_renderer renderer, struct ovf_device_memory *memory);

/**
 * Records the overlay of the picture that `ovf_renderer_record_uploads` was given last with this
 * index, over whatever was drawn, in the subpass that the renderer was made for; nothing where it
 * had none. Depth is neither read nor written. The picture's top left corner is at `left_px`,
 * `top_px`, as for `ovf_renderer_record_range`, which says what is set otherwise afterwards.
 */
ovf_status ovf_renderer_record_overlay(struct ovf_renderer renderer,
                                       const struct ovf_host_frame *frame,
                                       int32_t left_px,
                                       int32_t top_px);

/**
 * Makes a picture of the terrain's last frame ready and records the copies of what is new, with
 * the barriers that they need. Outside a pass, once for each frame and index, before its draws;
 * the device has finished what was recorded with this index before. `report` may be null.
 *
 * Buffers are submitted in the order in which their uploads were recorded. Where it fails nothing
 * was recorded; after `OVF_VULKAN` all of the ground is uploaded again. Of the terrain it is a call
 * as any: `OVF_BUSY` during a frame, `OVF_STALE` once it was destroyed.
 */
ovf_status ovf_renderer_record_uploads(struct ovf_renderer renderer,
                                       const struct ovf_host_frame *frame,
                                       const struct ovf_picture *picture,
                                       struct ovf_draw_report *report);

/**
 * Records the draws of one depth range, in the subpass that the renderer was made for, after the
 * picture's uploads. From the farthest, `ovf_draw_report.ranges` - 1, to the nearest, 0; the depth
 * was cleared since the one before, to 0 where `ovf_limits.depth_order` is reversed, else to 1. The
 * picture's top left corner is at `left_px`, `top_px` of the target, within which it fits.
 *
 * After it the range's depth is there for geometry of the host's, with `ovf_terrain_projection`.
 * Pipelines, descriptor sets 0 to 2, push constants, vertex and index buffers, viewport and scissor
 * are others then. Several threads may record ranges at once, each into a buffer of its own.
 */
ovf_status ovf_renderer_record_range(struct ovf_renderer renderer,
                                     const struct ovf_host_frame *frame,
                                     uint32_t range,
                                     int32_t left_px,
                                     int32_t top_px);

/**
 * The projection of one depth range of a view, as the ground is drawn with it: 16 numbers, column by
 * column, from eye space (x right, y up, z backward, metres from the eye) to Vulkan's clip space (y
 * down, z from 0 to w). With the axes and the eye of `ovf_terrain_eye`, a point's z and w are the
 * ground's to the last bit; only what is between the range's borders is seen.
 */
ovf_status ovf_terrain_projection(struct ovf_terrain terrain,
                                  uint32_t view,
                                  uint32_t range,
                                  float *columns);

/**
 * The ground of all pages that are there now. Some 20 µs for each page that came since the last
 * call, the first call for all of them. Take a new one after frames, and destroy the old one.
 */
ovf_status ovf_terrain_ground(struct ovf_terrain terrain, struct ovf_ground *ground);

/**
 * Gives a snapshot back. Calls that use it in other threads end undisturbed.
 */
ovf_status ovf_ground_destroy(struct ovf_ground ground);

/**
 * From body-fixed coordinates to latitude, longitude and height above the ellipsoid. The three
 * places to write to are one number each.
 */
ovf_status ovf_ground_to_geodetic(struct ovf_ground ground,
                                  const double *point_ecef_m,
                                  double *lat_rad,
                                  double *lon_rad,
                                  double *height_m);

/**
 * From latitude, longitude and height above the ellipsoid to body-fixed coordinates: three numbers.
 */
ovf_status ovf_ground_to_ecef(struct ovf_ground ground,
                              double lat_rad,
                              double lon_rad,
                              double height_m,
                              double *point_ecef_m);

/**
 * The ground at one place. The same bits as `ovf_ground_heights` gives.
 */
ovf_status ovf_ground_height(struct ovf_ground ground,
                             double lat_rad,
                             double lon_rad,
                             const struct ovf_query *query,
                             struct ovf_height *height);

/**
 * The ground at many places. A place that is none is answered so, and the others are not disturbed.
 */
ovf_status ovf_ground_heights(struct ovf_ground ground,
                              const struct ovf_places *places,
                              uint64_t count,
                              const struct ovf_query *query,
                              const struct ovf_height_columns *columns);

/**
 * The ground on the vertical of a body-fixed point of three numbers: JSBSim's `GetAGLevel` in SI.
 */
ovf_status ovf_ground_contact(struct ovf_ground ground,
                              const double *point_ecef_m,
                              const struct ovf_query *query,
                              struct ovf_contact *contact);

/**
 * Where a ray first meets the ground. `origin_ecef_m` and `direction_ecef` are three numbers each;
 * the direction has any length but 0; `max_m` may be infinite.
 */
ovf_status ovf_ground_ray(struct ovf_ground ground,
                          const double *origin_ecef_m,
                          const double *direction_ecef,
                          double max_m,
                          const struct ovf_query *query,
                          struct ovf_hit *hit);

/**
 * Whether anything lies between two body-fixed points of three numbers each, and how much there is
 * to spare.
 */
ovf_status ovf_ground_line_of_sight(struct ovf_ground ground,
                                    const double *from_ecef_m,
                                    const double *to_ecef_m,
                                    uint32_t refraction,
                                    const struct ovf_query *query,
                                    struct ovf_sight *sight);

/**
 * Has the pages loaded that heights of a level need in a region, as before a jump. They are part
 * of later snapshots as they come, and stay until `ovf_terrain_release` gives `*ticket` back.
 */
ovf_status ovf_terrain_request(struct ovf_terrain terrain,
                               const struct ovf_region *region,
                               uint32_t level,
                               uint64_t *ticket);

/**
 * Gives a requested region back. Where the scene's sources have become others since, there is no
 * ticket any more, and this says so.
 */
ovf_status ovf_terrain_release(struct ovf_terrain terrain, uint64_t ticket);

/**
 * How much of what a level needs in a region is there now.
 */
ovf_status ovf_terrain_readiness(struct ovf_terrain terrain,
                                 const struct ovf_region *region,
                                 uint32_t level,
                                 struct ovf_readiness *readiness);

/**
 * The same of a snapshot.
 */
ovf_status ovf_ground_readiness(struct ovf_ground ground,
                                const struct ovf_region *region,
                                uint32_t level,
                                struct ovf_readiness *readiness);

/**
 * Bounds on the ground of a region, from the finest pages that are there: for minimum altitudes.
 */
ovf_status ovf_ground_min_max(struct ovf_ground ground,
                              const struct ovf_region *region,
                              struct ovf_min_max *min_max);

/**
 * Records every frame from now on, edits included. To be asked for before the first frame; `name`
 * and `rate_hz` are what a replay shows.
 */
ovf_status ovf_terrain_record(struct ovf_terrain terrain,
                              const char *path,
                              const char *name,
                              double rate_hz);

/**
 * Completes the recording; `*frames` is how many it has. Without this it reads to its last frame.
 */
ovf_status ovf_terrain_finish_recording(struct ovf_terrain terrain, uint64_t *frames);

/**
 * Version of this library: major · 65536 + minor · 256 + patch.
 */
uint32_t ovf_version(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* OVERFLY_H */
