//! The exact picture plane of one frame: from points to pixels and back, all in f64.
//!
//! In:    the camera of a frame.
//! Out:   pixels of body-fixed points, rays of pixels.
//! Keeps: the camera's axes.
//! Not here: which pixels are looked at (`rays`), what they show (`trace`, `raster`).

use glam::{DVec2, DVec3};
use overfly_core::camera::Camera;

/// The projection of a frame: π of the definitions, without any f32.
#[derive(Clone, Copy, Debug)]
pub struct Screen {
    /// Where the eye is, body-fixed metres.
    pub eye: DVec3,
    /// Unit vectors right, up and into the picture.
    pub axes: [DVec3; 3],
    /// Pixels a unit of tangent.
    pub scale_px: f64,
    /// Width and height in pixels.
    pub size_px: [f64; 2],
    /// Nothing nearer is drawn, metres.
    pub near_m: f64,
}

impl Screen {
    /// Of a camera.
    pub fn new(camera: &Camera) -> Self {
        Self {
            eye: camera.eye.0,
            axes: [camera.right, camera.up, camera.forward],
            scale_px: camera.pixels_per_radian,
            size_px: camera.size_px.map(f64::from),
            near_m: camera.near_m,
        }
    }

    /// A point in camera axes: right, up, depth; metres.
    pub fn view(&self, point: DVec3) -> DVec3 {
        let away = point - self.eye;
        DVec3::new(away.dot(self.axes[0]), away.dot(self.axes[1]), away.dot(self.axes[2]))
    }

    /// Pixel of a point, counted from the upper left; `None` beside or behind the eye.
    pub fn pixel(&self, point: DVec3) -> Option<DVec2> {
        let view = self.view(point);
        (view.z > 0.0).then(|| self.pixel_of(view))
    }

    /// Whether a point lies in the picture, whatever is in front of it.
    pub fn shows(&self, point: DVec3) -> bool {
        let [width, height] = self.size_px;
        let inside = |px: DVec2| px.min_element() >= 0.0 && px.x <= width && px.y <= height;
        self.pixel(point).is_some_and(inside)
    }

    /// The same picture lying on another side: turned by so many quarters clockwise.
    pub fn turned(&self, quarters: u8) -> Self {
        let [right, up, forward] = self.axes;
        let [width, height] = self.size_px;
        let (axes, size_px) = match quarters % 4 {
            0 => ([right, up], [width, height]),
            1 => ([up, -right], [height, width]),
            2 => ([-right, -up], [width, height]),
            _ => ([-up, right], [height, width]),
        };
        Self { axes: [axes[0], axes[1], forward], size_px, ..*self }
    }

    /// Pixel of a point in camera axes before the eye.
    pub fn pixel_of(&self, view: DVec3) -> DVec2 {
        let scale = self.scale_px / view.z;
        let [width, height] = self.size_px;
        DVec2::new(0.5 * width + view.x * scale, 0.5 * height - view.y * scale)
    }

    /// Ray of a pixel in camera axes: its depth is 1.
    pub fn tangents(&self, pixel: DVec2) -> DVec3 {
        let [width, height] = self.size_px;
        let (x, y) = (pixel.x - 0.5 * width, 0.5 * height - pixel.y);
        DVec3::new(x / self.scale_px, y / self.scale_px, 1.0)
    }

    /// Turns a vector in camera axes to body-fixed axes.
    pub fn to_body(&self, view: DVec3) -> DVec3 {
        self.axes[0] * view.x + self.axes[1] * view.y + self.axes[2] * view.z
    }
}
