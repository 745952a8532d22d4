//! Parts of pictures, joined: every pixel from the part that it belongs to, bit for bit.
//!
//! Parts tell what they are of. Those of one picture must agree in the scene's content, technique, settings, seed, frame,
//! samples, instruction set and version, and there must be each share once; otherwise nothing is written, and the error
//! names the files and what differs. All files are read through before the first picture is written.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use halflight_image::{Picture, PicturePart, ToneCurve};

use super::part::{ASKED, EXPOSURE, OWN, PRECISION, SHARE, TONE, tone_of};
use super::{Encoding, JobError, Share, automatic_exposure, save};

/// What the parts of one picture have in common: keys, and what an error calls them.
const COMMON: [(&str, &str); 12] = [
    ("version", "version"),
    ("scene_hash", "content of the scene (hash)"),
    ("technique", "technique and settings"),
    ("seed", "seed"),
    ("time_seconds", "time in seconds"),
    ("simd", "instruction set"),
    (ASKED, "samples asked for"),
    (PRECISION, "precision"),
    (EXPOSURE, "exposure"),
    (TONE, "tone curve"),
    (SIZE, "size of the picture"),
    (CHANNELS, "layers"),
];
/// Of the file, not of its metadata.
const SIZE: &str = "size";
const CHANNELS: &str = "channels";

/// What is known of a part's file without its pixels.
struct Label {
    path: PathBuf,
    share: Share,
    /// By the keys of [`COMMON`].
    common: BTreeMap<&'static str, String>,
    frame: f64,
    whole: [usize; 2],
}

/// A picture to be joined.
pub struct Joint {
    /// The number of its frame.
    pub frame: f64,
    parts: Vec<Label>,
}

/// How the joined picture is written, where it is not as its parts say.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wishes {
    /// Stops of a PNG.
    pub exposure_ev: Option<f32>,
    /// The tone curve of a PNG.
    pub tone: Option<ToneCurve>,
}

/// Reads parts of any number of frames and sees that those of each are complete and of one picture. In order of frames.
///
/// # Errors
/// Files that cannot be read or are no parts; parts that differ, are missing or are there twice.
pub fn gather(paths: &[PathBuf]) -> Result<Vec<Joint>, JobError> {
    if paths.is_empty() {
        return Err(JobError::usage("there is nothing to merge: name the tiles"));
    }
    let mut joints: Vec<Joint> = Vec::new();
    for path in paths {
        let label = Label::of(path, &PicturePart::load_exr(path)?)?;
        match joints.iter_mut().find(|joint| joint.frame == label.frame) {
            Some(joint) => joint.parts.push(label),
            None => joints.push(Joint { frame: label.frame, parts: vec![label] }),
        }
    }
    joints.sort_by(|a, b| a.frame.total_cmp(&b.frame));
    joints.iter().try_for_each(Joint::check)?;
    // A sequence is of one scene, too.
    for joint in &joints[1..] {
        joint.parts[0].agrees(&joints[0].parts[0], &["time_seconds"])?;
    }
    Ok(joints)
}

/// Joins the parts of one picture and writes it, whole or not at all. `command` is for its metadata.
///
/// # Errors
/// As [`gather`]; a format that is not known, or trouble with the disk.
pub fn merge(paths: &[PathBuf], output: &Path, wishes: &Wishes, command: &str) -> Result<Picture, JobError> {
    let joints = gather(paths)?;
    let [joint] = joints.as_slice() else {
        let frames: Vec<String> = joints.iter().map(|joint| joint.frame.to_string()).collect();
        return Err(JobError::usage(format!("these are tiles of several frames: {}", frames.join(", "))));
    };
    joint.write(output, wishes, command)
}

impl Label {
    fn of(path: &Path, part: &PicturePart) -> Result<Self, JobError> {
        let refused = |found: String| JobError::failed(format!("cannot merge {}: {found}", path.display()));
        let metadata = &part.picture.metadata;
        let share = metadata.get(SHARE).ok_or_else(|| {
            refused(
                "this is no tile of a picture (tiles are what `halflight render --tile I/N` writes)".into(),
            )
        })?;
        let share: Share = share.parse().map_err(|e| refused(format!("its metadata are damaged: {e}")))?;
        let mut common = BTreeMap::new();
        let mut channels: Vec<&str> = part.picture.channels.iter().map(|c| c.name.as_str()).collect();
        channels.sort_unstable();
        let [width, height] = part.whole;
        for (key, said) in COMMON {
            let value = match key {
                SIZE => format!("{width}x{height}"),
                CHANNELS => channels.join(", "),
                _ => metadata
                    .get(key)
                    .cloned()
                    .ok_or_else(|| refused(format!("its metadata say nothing of the {said}")))?,
            };
            common.insert(key, value);
        }
        if metadata.contains_key("interrupted") {
            return Err(refused("this tile was interrupted before it was done (render it again)".into()));
        }
        let number =
            |key: &str| metadata.get(key).and_then(|text| text.parse::<f64>().ok()).filter(|x| x.is_finite());
        let frame = number("frame").ok_or_else(|| refused("its metadata say nothing of its frame".into()))?;
        let region =
            share.region(width, height).map_err(|e| refused(format!("its metadata are damaged: {e}")))?;
        let window = (part.origin, [part.picture.width, part.picture.height]);
        if window != ([region.x, region.y], [region.width, region.height]) {
            return Err(refused(format!("its pixels are not those of tile {share}")));
        }
        Ok(Self { path: path.to_path_buf(), share, common, frame, whole: part.whole })
    }

    /// Refuses what is not of the same picture, but for some keys.
    fn agrees(&self, other: &Self, but: &[&str]) -> Result<(), JobError> {
        let differ =
            COMMON.iter().find(|(key, _)| !but.contains(key) && self.common[key] != other.common[key]);
        let (what, here, there) = match differ {
            Some((key, said)) => (*said, self.common[key].clone(), other.common[key].clone()),
            None if self.share.count != other.share.count => {
                ("number of tiles", self.share.count.to_string(), other.share.count.to_string())
            }
            None => return Ok(()),
        };
        Err(JobError::failed(format!(
            "these tiles do not belong together: the {what} of {} is {here}, of {} {there}",
            self.path.display(),
            other.path.display()
        )))
    }
}

impl Joint {
    /// The size of the picture.
    pub fn size(&self) -> [usize; 2] {
        self.parts[0].whole
    }

    /// How many parts it has.
    pub fn part_count(&self) -> usize {
        self.parts.len()
    }

    fn check(&self) -> Result<(), JobError> {
        let first = &self.parts[0];
        self.parts[1..].iter().try_for_each(|part| part.agrees(first, &[]))?;
        let count = first.share.count;
        let mut files: BTreeMap<u32, &Path> = BTreeMap::new();
        for part in &self.parts {
            if let Some(other) = files.insert(part.share.index, &part.path) {
                return Err(JobError::failed(format!(
                    "tile {} of frame {} is there twice: {} and {} (name each tile once)",
                    part.share,
                    self.frame,
                    other.display(),
                    part.path.display()
                )));
            }
        }
        let missing: Vec<String> = (1..=count)
            .filter(|index| !files.contains_key(index))
            .map(|index| format!("{index}/{count}"))
            .collect();
        if missing.is_empty() {
            return Ok(());
        }
        Err(JobError::failed(format!(
            "frame {} is not whole: {} of {count} tiles {} missing: {}",
            self.frame,
            missing.len(),
            if missing.len() == 1 { "is" } else { "are" },
            shortened(&missing)
        )))
    }

    /// Joins the parts.
    ///
    /// # Errors
    /// If a file can no longer be read, or has become another.
    pub fn join(&self, command: &str) -> Result<Picture, JobError> {
        let [width, height] = self.size();
        let mut whole = Picture::new(width, height);
        let (mut samples, mut seconds) = (0.0, 0.0);
        for label in &self.parts {
            let part = PicturePart::load_exr(&label.path)?;
            let again = Label::of(&label.path, &part)?;
            again.agrees(&self.parts[0], &[])?;
            if again.share != label.share || again.frame != self.frame {
                let path = label.path.display();
                return Err(JobError::failed(format!("{path} has become another tile while it was read")));
            }
            let number = |key: &str| {
                part.picture.metadata.get(key).and_then(|text| text.parse::<f64>().ok()).unwrap_or(0.0)
            };
            let pixels = part.picture.width * part.picture.height;
            samples += number("samples") * pixels as f64;
            seconds += number("seconds");
            if whole.channels.is_empty() {
                whole.metadata = part.picture.metadata.clone();
                for channel in &part.picture.channels {
                    whole.push(channel.name.clone(), vec![0.0; width * height]);
                }
            }
            for channel in &mut whole.channels {
                let Some(values) = part.picture.channel(&channel.name) else { continue };
                for (row, values) in values.chunks_exact(part.picture.width).enumerate() {
                    let start = (part.origin[1] + row) * width + part.origin[0];
                    channel.values[start..start + values.len()].copy_from_slice(values);
                }
            }
        }
        for key in OWN {
            whole.metadata.remove(key);
        }
        let entries = [
            ("command", command.to_string()),
            ("samples", (samples / (width * height) as f64).to_string()),
            ("seconds", format!("{seconds:.3}")),
            ("merged_tiles", self.parts.len().to_string()),
        ];
        whole.metadata.extend(entries.map(|(key, value)| (key.to_string(), value)));
        Ok(whole)
    }

    /// Joins the parts and writes the picture, whole or not at all.
    ///
    /// # Errors
    /// As [`join`](Self::join), or trouble with the disk.
    pub fn write(&self, output: &Path, wishes: &Wishes, command: &str) -> Result<Picture, JobError> {
        let picture = self.join(command)?;
        let common = &self.parts[0].common;
        let exposure_ev = wishes
            .exposure_ev
            .or_else(|| common[EXPOSURE].parse().ok())
            .unwrap_or_else(|| picture.rgb().map_or(0.0, |image| automatic_exposure(&image)));
        let tone = wishes.tone.or_else(|| tone_of(&common[TONE])).unwrap_or_default();
        save(output, &picture, &Encoding { exposure_ev, tone, half: common[PRECISION] == "half" })?;
        Ok(picture)
    }
}

/// The first few of a list, and how many more there are.
fn shortened(list: &[String]) -> String {
    const SHOWN: usize = 8;
    match list.len() {
        0..=SHOWN => list.join(", "),
        many => format!("{} and {} more", list[..SHOWN].join(", "), many - SHOWN),
    }
}
