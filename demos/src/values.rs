//! Values of options: sizes, counts, radii, assignments.

use std::path::PathBuf;
use std::str::FromStr;

use lightloom_strategies::{Composed, Layer, ScreenSpace, SortedGrid};

use crate::{Error, MAX_SIZE};

/// `WxH`, each 1 to 16384 pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ImageSize(pub(crate) [u32; 2]);

impl FromStr for ImageSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = |side: &str| side.parse::<u32>().ok();
        let sides = text.split_once(['x', 'X', '×']).and_then(|(w, h)| Some([parse(w)?, parse(h)?]));
        let Some(size) = sides else {
            return Err("write width and height in pixels as WxH, such as 640x360".to_owned());
        };
        if size.iter().any(|side| *side == 0 || *side > MAX_SIZE) {
            return Err(format!("width and height must each be 1 to {MAX_SIZE} pixels"));
        }
        Ok(Self(size))
    }
}

/// What stands before the dot in assignments to the filter.
pub(crate) const FILTER: &str = "filter";

/// `K=V`, `STRATEGY.K=V` or `filter.K=V`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Assignment {
    /// The strategy it is for, or [`FILTER`]; all strategies that have the key when not given.
    pub(crate) strategy: Option<String>,
    /// The parameter.
    pub(crate) key: String,
    /// Its value.
    pub(crate) value: String,
}

impl FromStr for Assignment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "write a parameter and its value as K=V, or NAME.K=V for one strategy".to_owned();
        let (key, value) = text.split_once('=').ok_or_else(wrong)?;
        // Parameters have no dot in their names, strategies may.
        let (strategy, key) = match key.trim().rsplit_once('.') {
            Some((FILTER, key)) => (Some(FILTER.to_owned()), key),
            Some((strategy, key)) => (Some(parse_strategy(strategy)?), key),
            None => (None, key.trim()),
        };
        if key.is_empty() || value.trim().is_empty() {
            return Err(wrong());
        }
        Ok(Self { strategy, key: key.to_owned(), value: value.trim().to_owned() })
    }
}

/// What `--environment` names.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum EnvironmentArg {
    /// The same radiance from everywhere (W·m⁻²·sr⁻¹).
    Constant([f32; 3]),
    /// A map and its rotation about +y (degrees).
    Map(PathBuf, f32),
}

impl FromStr for EnvironmentArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some(hex) = text.strip_prefix('#') {
            let bits = u32::from_str_radix(hex, 16).ok().filter(|_| hex.len() == 6 && !hex.starts_with('+'));
            let bits = bits.ok_or_else(|| "write a colour as #rrggbb, such as #8899ff".to_owned())?;
            return Ok(Self::Constant([16, 8, 0].map(|shift| linear_of_srgb((bits >> shift & 0xff) as u8))));
        }
        let parts: Vec<Option<f32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
        if let [Some(r), Some(g), Some(b)] = parts[..] {
            if ![r, g, b].iter().all(|c| c.is_finite() && *c >= 0.0) {
                return Err("the radiance R,G,B must be finite and not negative".to_owned());
            }
            return Ok(Self::Constant([r, g, b]));
        }
        let (path, degrees) = match text.rsplit_once(',') {
            Some((path, degrees)) => match degrees.trim().parse::<f32>() {
                Ok(degrees) if degrees.is_finite() => (path, degrees),
                _ => return Err("write the map's rotation in degrees behind the comma, such as sky.hdr,90".to_owned()),
            },
            None => (text, 0.0),
        };
        if path.is_empty() {
            return Err("write a file, FILE,DEGREES, a radiance R,G,B or #rrggbb".to_owned());
        }
        Ok(Self::Map(path.into(), degrees))
    }
}

/// Linear value of an sRGB byte (IEC 61966-2-1).
fn linear_of_srgb(byte: u8) -> f32 {
    let encoded = f32::from(byte) / 255.0;
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// `NAME=WEIGHT`: a lamp and the factor on its photons.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LightPhotons {
    /// The lamp's name.
    pub(crate) name: String,
    /// The factor; the scene knows its range.
    pub(crate) weight: f32,
}

impl FromStr for LightPhotons {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "write a light's name and a factor as NAME=WEIGHT, such as lamp=2".to_owned();
        // Names may hold an equals sign, numbers not.
        let (name, weight) = text.rsplit_once('=').ok_or_else(wrong)?;
        let weight = weight.trim().parse().map_err(|_| wrong())?;
        if name.is_empty() { Err(wrong()) } else { Ok(Self { name: name.to_owned(), weight }) }
    }
}

/// A count above 0, with `k` for thousands or `M` for millions, such as 250k or 1.5M.
pub(crate) fn parse_count(text: &str) -> Result<u32, String> {
    let wrong = || "write a number above 0, such as 50000, 250k or 1M".to_owned();
    let (digits, factor) = match text.strip_suffix(['k', 'K']) {
        Some(digits) => (digits, 1e3),
        None => text.strip_suffix(['m', 'M']).map_or((text, 1.0), |digits| (digits, 1e6)),
    };
    // `f64` would also take "inf", "nan", "1e3" and signs.
    if digits.is_empty() || !digits.bytes().all(|b| b.is_ascii_digit() || b == b'.') {
        return Err(wrong());
    }
    let count = digits.parse::<f64>().map_err(|_| wrong())? * factor;
    if count > f64::from(u32::MAX) {
        return Err(format!("at most {} is possible", u32::MAX));
    }
    if count < 1.0 || (count - count.round()).abs() > 1e-6 {
        return Err(wrong());
    }
    Ok(count.round() as u32)
}

/// A whole number above 0.
pub(crate) fn parse_positive(text: &str) -> Result<u32, String> {
    match text.parse::<u32>() {
        Ok(0) | Err(_) => Err(format!("write a whole number, 1 to {}", u32::MAX)),
        Ok(number) => Ok(number),
    }
}

/// A length above 0 (m).
pub(crate) fn parse_radius(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(radius) if radius.is_finite() && radius > 0.0 => Ok(radius),
        _ => Err("write a length in metres above 0, such as 0.05".to_owned()),
    }
}

/// A time from 0 on (s).
pub(crate) fn parse_time(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(time) if time.is_finite() && time >= 0.0 => Ok(time),
        _ => Err("write a time in seconds, 0 or above, such as 1.5".to_owned()),
    }
}

/// Images per second.
pub(crate) fn parse_rate(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(rate) if (1e-3..=1e6).contains(&rate) => Ok(rate),
        _ => Err("write a number of images per second, 0.001 to 1000000".to_owned()),
    }
}

/// The name of a strategy that there is, or of two that are composed; whether they can be is told when they are built.
pub(crate) fn parse_strategy(text: &str) -> Result<String, String> {
    let names = crate::session::strategy_names();
    let joint = Composed::JOINT;
    match text.split(joint).find(|part| !names.contains(part)) {
        None => Ok(text.to_owned()),
        Some(part) => Err(format!(
            "no strategy has the name `{part}`; there are: {}; two make one frame as `{}{joint}{}`",
            names.join(", "),
            SortedGrid::NAME,
            ScreenSpace::NAME,
        )),
    }
}

/// What an image shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Shown {
    /// A layer.
    Layer(Layer),
    /// What a pass writes: its name, with a binding's behind a dot where it writes several textures.
    Pass(String),
}

impl Shown {
    /// The layer, for commands that show nothing else.
    pub(crate) fn layer(&self) -> Result<Layer, Error> {
        match self {
            Self::Layer(layer) => Ok(*layer),
            Self::Pass(name) => {
                Err(Error::Usage(format!("--layer pass:{name}: only `lightloom render` shows passes; name a layer")))
            }
        }
    }
}

impl FromStr for Shown {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some(pass) = text.strip_prefix("pass:") {
            let missing =
                || "write the pass's name behind `pass:`, such as pass:gbuffer; `lightloom graph` shows the names".to_owned();
            return if pass.is_empty() { Err(missing()) } else { Ok(Self::Pass(pass.to_owned())) };
        }
        let layer = Layer::ALL.into_iter().find(|layer| layer.name() == text);
        let names: Vec<&str> = Layer::ALL.iter().map(|layer| layer.name()).collect();
        layer.map(Self::Layer).ok_or_else(|| format!("no layer has this name; there are: {}, pass:NAME", names.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!("320x180".parse(), Ok(ImageSize([320, 180])));
        assert_eq!("16384x1".parse(), Ok(ImageSize([16384, 1])));
        for wrong in ["0x5", "5x0", "16385x1", "5", "x", "-1x5", "5x5x5", "99999999999x1"] {
            assert!(wrong.parse::<ImageSize>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn environments() {
        assert_eq!("0.5,1,2".parse(), Ok(EnvironmentArg::Constant([0.5, 1.0, 2.0])));
        assert_eq!("#ff0000".parse(), Ok(EnvironmentArg::Constant([1.0, 0.0, 0.0])));
        assert_eq!("a/sky.hdr".parse(), Ok(EnvironmentArg::Map("a/sky.hdr".into(), 0.0)));
        assert_eq!("sky.exr,-90".parse(), Ok(EnvironmentArg::Map("sky.exr".into(), -90.0)));
        for wrong in ["", ",5", "sky.exr,wide", "#12", "#+12345", "-1,0,0", "inf,0,0"] {
            assert!(wrong.parse::<EnvironmentArg>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn photons_of_lights() {
        assert_eq!("a=b=2".parse(), Ok(LightPhotons { name: "a=b".into(), weight: 2.0 }));
        for wrong in ["lamp", "=2", "lamp=", "lamp=much"] {
            assert!(wrong.parse::<LightPhotons>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn counts() {
        assert_eq!(parse_count("1M"), Ok(1_000_000));
        assert_eq!(parse_count("250k"), Ok(250_000));
        assert_eq!(parse_count("1.5M"), Ok(1_500_000));
        assert_eq!(parse_count("7"), Ok(7));
        for wrong in ["0", "", "k", "-5", "1.5", "5G", "inf", "nan", "1e3", "5000M", "1..2"] {
            assert!(parse_count(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn layers() {
        assert_eq!("caustic".parse(), Ok(Shown::Layer(Layer::Caustic)));
        assert_eq!("pass:a.b".parse(), Ok(Shown::Pass("a.b".to_owned())));
        assert!("pass:".parse::<Shown>().is_err(), "a pass without a name");
        let error = "shadow".parse::<Shown>().unwrap_err();
        assert!(error.contains("indirect") && error.contains("depth"), "{error}");
    }

    #[test]
    fn radii() {
        assert_eq!(parse_radius("0.05"), Ok(0.05));
        for wrong in ["0", "-1", "inf", "NaN", "1m"] {
            assert!(parse_radius(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn times_and_rates() {
        assert_eq!((parse_time("0"), parse_time("1.5"), parse_rate("29.97")), (Ok(0.0), Ok(1.5), Ok(29.97)));
        for wrong in ["-0.1", "inf", "NaN", "1s", ""] {
            assert!(parse_time(wrong).is_err() && parse_rate(wrong).is_err(), "{wrong}");
        }
        assert!(parse_rate("0").is_err(), "no image at all");
    }

    #[test]
    fn assignments() {
        let all: Assignment = "cell=0.5".parse().unwrap();
        assert_eq!((all.strategy, all.key.as_str(), all.value.as_str()), (None, "cell", "0.5"));
        let dotted: Assignment = "splat-2.5d.corners=8.5".parse().unwrap();
        assert_eq!((dotted.strategy.as_deref(), &*dotted.key, &*dotted.value), (Some("splat-2.5d"), "corners", "8.5"));
        let one: Assignment = "tiled.size=8".parse().unwrap();
        assert_eq!((one.strategy.as_deref(), one.key.as_str()), (Some("tiled"), "size"));
        let composed: Assignment = "splat-2.5d+screen-space.gain=2".parse().unwrap();
        assert_eq!((composed.strategy.as_deref(), composed.key.as_str()), (Some("splat-2.5d+screen-space"), "gain"));
        let filter: Assignment = "filter.clip=2".parse().unwrap();
        assert_eq!((filter.strategy.as_deref(), filter.key.as_str()), (Some(FILTER), "clip"));
        for wrong in ["cell", "=1", "cell=", "nobody.cell=1", "tiled+nobody.cell=1", ""] {
            assert!(wrong.parse::<Assignment>().is_err(), "{wrong}");
        }
    }
}
