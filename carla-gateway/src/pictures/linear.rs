//! Between the bytes of a picture and light.

use std::sync::LazyLock;

/// Steps of light from black to white.
const STEPS: usize = 4_096;

static LIGHT: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|byte| {
        let encoded = byte as f32 / 255.0;
        if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    })
});

static BYTES: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let encode = |step: usize| {
        let linear = step as f32 / STEPS as f32;
        let encoded = if linear <= 0.003_130_8 {
            linear * 12.92
        } else {
            1.055 * linear.powf(1.0 / 2.4) - 0.055
        };
        (encoded * 255.0 + 0.5) as u8
    };
    (0..=STEPS).map(encode).collect()
});

/// Light of a pixel: linear sRGB, 0 to 1.
pub(super) fn light([red, green, blue, _]: [u8; 4]) -> [f32; 3] {
    [red, green, blue].map(|part| LIGHT[usize::from(part)])
}

/// The pixel that shows light.
pub(super) fn pixel(light: [f32; 3]) -> [u8; 4] {
    let [red, green, blue] = light.map(|part| {
        let step = (part.clamp(0.0, 1.0) * STEPS as f32 + 0.5) as usize;
        BYTES.get(step).copied().unwrap_or(u8::MAX)
    });
    [red, green, blue, 255]
}

/// Bytes to the power of a number, where 255 is 1.
pub(super) fn gamma_curve(power: f32) -> [u8; 256] {
    std::array::from_fn(|byte| ((byte as f32 / 255.0).powf(power) * 255.0 + 0.5) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_but_the_darkest_comes_back() {
        for byte in 4..=255u8 {
            let [back, ..] = pixel(light([byte; 4]));
            assert!(back.abs_diff(byte) <= 1, "{byte} {back}");
        }
        assert_eq!(pixel([-1.0, 2.0, 0.0]), [0, 255, 0, 255]);
    }
}
