//! `halflight sh`: environment maps as spherical harmonics, turned, converted and shown.

mod light;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};
use glam::{DMat3, DVec3, Vec3};
use halflight_image::{Picture, RgbImage, ToneCurve, load_rgb};
use halflight_sh::convert::Convention;
use halflight_sh::window::{self, Window};
use halflight_sh::{Sh, ShError, project};
use serde_json::json;

use super::console::Console;
use super::failure::Failure;
use super::output::{self, Encoding};
use super::parse::{Size, finite};
use super::table::Table;
use light::Light;

#[derive(Args, Debug)]
pub(crate) struct ShArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Project a latitude-longitude picture of the environment
    Project {
        /// The picture, .exr or .hdr; its central column looks along -z, its top along +y
        environment: PathBuf,
        /// Bands: order n has n² coefficients; 1 to 8
        #[arg(long, value_name = "N", default_value_t = 4, value_parser = order)]
        order: usize,
        /// Scale bands down until nothing is negative
        #[arg(long, value_name = "FAMILY")]
        window: Option<Family>,
        /// The file, .json
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// Turn the light about an axis
    Rotate {
        /// A file that `project` wrote
        light: PathBuf,
        /// The axis: x,y,z
        #[arg(long, value_name = "X,Y,Z", default_value = "0,1,0", value_parser = axis, allow_hyphen_values = true)]
        axis: DVec3,
        /// The angle, counter-clockwise as seen from the tip of the axis
        #[arg(long, value_name = "DEGREES", value_parser = finite, allow_negative_numbers = true)]
        degrees: f64,
        /// The file, .json
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// Write the coefficients as another library does
    Convert {
        /// A file that `project` wrote
        light: PathBuf,
        /// halflight, directxmath, threejs, e3nn, e3nn-component, e3nn-norm, filament, filament-irradiance
        #[arg(long, value_name = "CONVENTION", value_parser = convention)]
        to: Convention,
        /// The file, .json
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// Print the energy of each band, and show what the coefficients make of the light
    Show {
        /// A file that `project` wrote
        light: PathBuf,
        /// A latitude-longitude picture, .png, .hdr or .exr
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
        /// Its columns and rows
        #[arg(long, value_name = "WxH", default_value = "256x128")]
        size: Size,
        /// Show irradiance over π by normal, instead of radiance by direction
        #[arg(long)]
        irradiance: bool,
    },
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Family {
    /// Raised cosine
    Hanning,
    /// sin x / x
    Lanczos,
}

fn order(text: &str) -> Result<usize, String> {
    let order = text.parse().map_err(|_| format!("expected a whole number, found {text:?}"))?;
    if halflight_sh::ORDERS.contains(&order) { Ok(order) } else { Err(ShError::Order { order }.to_string()) }
}

fn axis(text: &str) -> Result<DVec3, String> {
    let numbers = text.split(',').map(|part| part.trim().parse::<f64>()).collect::<Result<Vec<f64>, _>>();
    match numbers.as_deref() {
        Ok(&[x, y, z]) => {
            DVec3::new(x, y, z).try_normalize().ok_or_else(|| format!("{text} has no direction"))
        }
        _ => Err(format!("expected three numbers, for example 0,1,0, found {text:?}")),
    }
}

fn convention(text: &str) -> Result<Convention, String> {
    Convention::from_name(text).ok_or_else(|| format!("there are {}", light::convention_names()))
}

/// An expression with an order that is known only now as a constant.
macro_rules! at_order {
    ($order:expr, $n:ident => $body:expr) => {
        match $order {
            1 => {
                const $n: usize = 1;
                $body
            }
            2 => {
                const $n: usize = 2;
                $body
            }
            3 => {
                const $n: usize = 3;
                $body
            }
            4 => {
                const $n: usize = 4;
                $body
            }
            5 => {
                const $n: usize = 5;
                $body
            }
            6 => {
                const $n: usize = 6;
                $body
            }
            7 => {
                const $n: usize = 7;
                $body
            }
            8 => {
                const $n: usize = 8;
                $body
            }
            order => Err(Failure::failed(ShError::Order { order })),
        }
    };
}

pub(crate) fn run(args: &ShArgs, console: Console) -> Result<(), Failure> {
    match &args.action {
        Action::Project { environment, order, window, output } => {
            check(output.as_deref())?;
            let image = load_rgb(environment)?;
            if image.width != 2 * image.height {
                console.warn(&format!(
                    "{} has {} × {} pixels; a whole sphere has twice as many columns as rows",
                    environment.display(),
                    image.width,
                    image.height
                ));
            }
            let light = at_order!(*order, N => project_image::<N>(&image, *window, console))?;
            finish(&light, output.as_deref(), console)
        }
        Action::Rotate { light, axis, degrees, output } => {
            check(output.as_deref())?;
            let light = Light::load(light)?;
            let turn = DMat3::from_axis_angle(*axis, degrees.to_radians());
            let turned = at_order!(light.order, N => {
                let [r, g, b] = functions::<N>(&light)?;
                coefficients(light.convention, [r.rotated(&turn), g.rotated(&turn), b.rotated(&turn)])
            })?;
            finish(&turned, output.as_deref(), console)
        }
        Action::Convert { light, to, output } => {
            check(output.as_deref())?;
            let light = Light::load(light)?;
            let converted = at_order!(light.order, N => coefficients(*to, functions::<N>(&light)?))?;
            finish(&converted, output.as_deref(), console)
        }
        Action::Show { light, output, size, irradiance } => {
            if let Some(path) = output {
                output::Format::of(path)?;
                output::check_writable(path)?;
            }
            let light = Light::load(light)?;
            print(&light, console)?;
            let Some(path) = output else { return Ok(()) };
            let picture =
                at_order!(light.order, N => Ok(picture(&functions::<N>(&light)?, *size, *irradiance)))?;
            save_picture(path, &picture)?;
            console.note(&format!("wrote {}", path.display()));
            Ok(())
        }
    }
}

fn check(output: Option<&Path>) -> Result<(), Failure> {
    output.map_or(Ok(()), output::check_writable)
}

/// Three functions in this project's convention.
fn functions<const N: usize>(light: &Light) -> Result<[Sh<N, f64>; 3], Failure> {
    let channel = |channel: usize| {
        let values: Vec<f64> = light.coefficients.iter().map(|colour| colour[channel]).collect();
        Sh::from_convention(light.convention, &values).map_err(Failure::failed)
    };
    Ok([channel(0)?, channel(1)?, channel(2)?])
}

fn coefficients<const N: usize>(
    convention: Convention,
    [r, g, b]: [Sh<N, f64>; 3],
) -> Result<Light, Failure> {
    if N > convention.largest_order() {
        return Err(Failure::failed(format!(
            "the light has order {N}, and this convention ends at order {}: project with --order {} first",
            convention.largest_order(),
            convention.largest_order()
        )));
    }
    let of = |sh: Sh<N, f64>| sh.to_convention(convention).map_err(Failure::failed);
    let (r, g, b) = (of(r)?, of(g)?, of(b)?);
    let coefficients = (0..N * N).map(|i| [r[i], g[i], b[i]]).collect();
    Ok(Light { convention, order: N, coefficients })
}

fn project_image<const N: usize>(
    image: &RgbImage,
    family: Option<Family>,
    console: Console,
) -> Result<Light, Failure> {
    let texel = |x: usize, y: usize| Vec3::from(image.pixels[y * image.width + x]);
    let mut sh = project::lat_long::<N>(image.width, image.height, texel).map_err(Failure::failed)?;
    let kept = project::kept_energy(image.width, image.height, texel, &sh).map_err(Failure::failed)?;
    console.note(&format!("order {N} keeps {:.1} % of the energy of the light", 100.0 * kept));
    if kept < 0.5 {
        console.warn("most of the energy sits in lights too small for this order, such as a sun");
    }
    if let Some(family) = family {
        let width = 1.0;
        let family = match family {
            Family::Hanning => Window::Hanning { width },
            Family::Lanczos => Window::Lanczos { width },
        };
        let (windowed, chosen) = window::to_non_negative(&sh, family);
        sh = windowed;
        match chosen {
            Some(Window::Hanning { width } | Window::Lanczos { width }) => {
                console.note(&format!("a window {width:.2} bands wide leaves nothing negative"));
            }
            None => console.note("nothing is negative without a window"),
        }
    }
    coefficients(Convention::Halflight, sh.map(|sh| sh.cast()))
}

/// Prints the coefficients, or writes them.
fn finish(light: &Light, output: Option<&Path>, console: Console) -> Result<(), Failure> {
    match output {
        Some(path) => {
            light.save(path)?;
            console.note(&format!("wrote {}", path.display()));
        }
        None => {
            let mut table = Table::new(["l", "m", "red", "green", "blue"]);
            for (i, colour) in light.coefficients.iter().enumerate() {
                let l = i.isqrt();
                let mut cells = vec![l.to_string(), (i as i64 - (l * l + l) as i64).to_string()];
                cells.extend(colour.map(|value| format!("{value:.6}")));
                table.row(cells);
            }
            console.answer(table.to_text().trim_end());
        }
    }
    console.event("coefficients", light.to_json());
    Ok(())
}

/// Energy of each band, in parts of the whole.
fn print(light: &Light, console: Console) -> Result<(), Failure> {
    let energies = at_order!(light.order, N => {
        let functions = functions::<N>(light)?;
        let of_band = |l: usize| functions.iter().flat_map(|sh| sh.band(l)).map(|value| value * value).sum::<f64>();
        Ok((0..N).map(of_band).collect::<Vec<f64>>())
    })?;
    let total: f64 = energies.iter().sum();
    let mut table = Table::new(["band", "energy", "share %"]);
    for (l, energy) in energies.iter().enumerate() {
        let share = if total > 0.0 { 100.0 * energy / total } else { 0.0 };
        table.row([l.to_string(), format!("{energy:.5}"), format!("{share:.2}")]);
    }
    console.answer(table.to_text().trim_end());
    console.event("bands", json!({ "order": light.order, "energy": energies }));
    Ok(())
}

fn picture<const N: usize>(functions: &[Sh<N, f64>; 3], size: Size, irradiance: bool) -> RgbImage {
    let shown: [Sh<N>; 3] = functions.each_ref().map(|sh| {
        let sh = if irradiance { sh.irradiance() * std::f64::consts::FRAC_1_PI } else { *sh };
        sh.cast()
    });
    RgbImage::from_fn(size.width, size.height, |x, y| {
        let basis = Sh::<N>::basis(project::lat_long_direction(size.width, size.height, x, y).as_vec3());
        shown.each_ref().map(|sh| sh.dot(&basis).max(0.0))
    })
}

fn save_picture(path: &Path, image: &RgbImage) -> Result<(), Failure> {
    let mut picture = Picture::new(image.width, image.height);
    for (channel, name) in ["R", "G", "B"].into_iter().enumerate() {
        picture.push(name, image.pixels.iter().map(|pixel| pixel[channel]).collect());
    }
    output::save(path, &picture, &Encoding { exposure_ev: 0.0, tone: ToneCurve::Srgb, half: false })
}
