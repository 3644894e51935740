//! Colours that the eye orders as the numbers behind them.

/// A way from the smallest to the largest number in colours of even steps to the eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColourMap {
    /// From dark violet over green to light yellow: more is lighter.
    Sequential,
    /// From blue over light grey to red; the middle of the range is neutral.
    Diverging,
}

impl ColourMap {
    /// Red, green and blue of a number between 0 and 1.
    pub fn colour(self, share: f64) -> [u8; 3] {
        let share = share.clamp(0.0, 1.0);
        let (lightness, chroma, hue) = match self {
            Self::Sequential => (0.35 + 0.59 * share, 0.14, 295.0 - 190.0 * share),
            Self::Diverging => {
                let side = 2.0 * share - 1.0;
                let hue = if side < 0.0 { 255.0 } else { 28.0 };
                (0.95 - 0.47 * side.abs(), 0.19 * side.abs(), hue)
            }
        };
        // The screen shows less colour at some lightnesses: as much as it can.
        let mut chroma: f64 = chroma;
        for _ in 0..200 {
            let linear = linear_rgb(lightness, chroma, hue);
            if linear.iter().all(|x| (-1e-4..=1.0001).contains(x)) {
                break;
            }
            chroma *= 0.98;
        }
        linear_rgb(lightness, chroma, hue).map(encoded)
    }

    /// The colour as `#rrggbb`.
    pub(super) fn hex(self, share: f64) -> String {
        let [red, green, blue] = self.colour(share);
        format!("#{red:02x}{green:02x}{blue:02x}")
    }
}

/// Oklab (Ottosson, 2020) to linear red, green and blue; hue in degrees.
fn linear_rgb(lightness: f64, chroma: f64, hue: f64) -> [f64; 3] {
    let angle = hue.to_radians();
    let (a, b) = (chroma * libm::cos(angle), chroma * libm::sin(angle));
    let cube = |x: f64| x * x * x;
    let l = cube(lightness + 0.3963377774 * a + 0.2158037573 * b);
    let m = cube(lightness - 0.1055613458 * a - 0.0638541728 * b);
    let s = cube(lightness - 0.0894841775 * a - 1.2914855480 * b);
    [
        4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
        -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
        -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s,
    ]
}

/// A linear component as a byte of sRGB.
fn encoded(linear: f64) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let value = if linear <= 0.0031308 {
        12.92 * linear
    } else {
        1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055
    };
    (255.0 * value).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance of sRGB (IEC 61966-2-1).
    fn luminance(colour: [u8; 3]) -> f64 {
        let linear = colour.map(|c| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 {
                c / 12.92
            } else {
                libm::pow((c + 0.055) / 1.055, 2.4)
            }
        });
        0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    }

    #[test]
    fn white_and_black_are_where_oklab_has_them() {
        assert_eq!(linear_rgb(1.0, 0.0, 0.0).map(encoded), [255; 3]);
        assert_eq!(linear_rgb(0.0, 0.0, 0.0).map(encoded), [0; 3]);
    }

    #[test]
    fn more_is_lighter() {
        let at = |k: i32| luminance(ColourMap::Sequential.colour(f64::from(k) / 50.0));
        assert!((0..50).all(|k| at(k) < at(k + 1)));
        let ends = [0.0, 0.5, 1.0].map(|t| luminance(ColourMap::Diverging.colour(t)));
        assert!(ends[1] > ends[0] && ends[1] > ends[2]);
    }

    #[test]
    fn ends_of_the_diverging_map_are_blue_and_red() {
        let [red, _, blue] = ColourMap::Diverging.colour(0.0);
        assert!(blue > red);
        let [red, _, blue] = ColourMap::Diverging.colour(1.0);
        assert!(red > blue);
        assert_eq!(
            ColourMap::Diverging.colour(-3.0),
            ColourMap::Diverging.colour(0.0)
        );
    }
}
