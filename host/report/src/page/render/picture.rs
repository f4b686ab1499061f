//! Pixels to PNG.

use super::raster::Raster;

/// The colors of a surface in shadow, half lit and in full light, in sRGB: a bluish clay.
const TONES: [[f32; 3]; 3] = [[28.0, 38.0, 56.0], [118.0, 142.0, 170.0], [244.0, 248.0, 252.0]];

/// A picture being composed: sRGB with coverage.
pub(super) struct Picture {
    width: u32,
    height: u32,
    pixels: Vec<[u8; 4]>,
}

impl Picture {
    /// An empty, transparent picture.
    pub(super) fn new(width: u32, height: u32) -> Self {
        Self { width, height, pixels: vec![[0; 4]; width as usize * height as usize] }
    }

    fn at(&mut self, x: u32, y: u32) -> Option<&mut [u8; 4]> {
        if x >= self.width || y >= self.height {
            return None;
        }
        self.pixels.get_mut(y as usize * self.width as usize + x as usize)
    }

    /// Puts a rendered mesh with its upper left corner at (`left`, `top`).
    pub(super) fn draw(&mut self, raster: &Raster, left: u32, top: u32) {
        for (i, &(light, coverage)) in (0..).zip(&raster.pixels) {
            if coverage > 0.0
                && let Some(pixel) = self.at(left + i % raster.size, top + i / raster.size)
            {
                let [r, g, b] = tone(light);
                *pixel = [r, g, b, (coverage * 255.0).round() as u8];
            }
        }
    }

    /// The picture as a PNG file.
    pub(super) fn png(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        // By this, a picture is recognized as one that may be replaced. Latin letters are always taken.
        let _ = encoder.add_text_chunk("Software".into(), "Palpate".into());
        // Writing to memory fails only if the picture is empty or its data has another size, and then it stays empty.
        if let Ok(mut writer) = encoder.write_header() {
            let _ = writer.write_image_data(self.pixels.as_flattened());
        }
        bytes
    }
}

/// The color of a brightness from 0 to 1.
fn tone(light: f32) -> [u8; 3] {
    // In steps that the eye does not see and that compress to half the size.
    let t = (light.clamp(0.0, 1.0) * 64.0).round() / 32.0;
    let [dark, middle, bright] = TONES;
    let (from, to, t) = if t < 1.0 { (dark, middle, t) } else { (middle, bright, t - 1.0) };
    std::array::from_fn(|i| (from[i] + (to[i] - from[i]) * t).round() as u8)
}
