use std::collections::{BTreeMap, HashSet};
use std::io::Cursor;

use exr::block::UncompressedBlock;
use exr::block::chunk::{Chunk, CompressedBlock};
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Text};
use exr::meta::header::Header;
use halflight_file::LoadError;
use rayon::prelude::*;

use super::samples::Planes;
use super::write::PREFIX;
use crate::source::{DEFLATE_RATIO, Source, quietly};
use crate::{Channel, Picture, PicturePart};

/// Blocks decompressed at a time: enough to keep every core busy, few enough to keep memory low.
const BATCH: usize = 64;

/// A display window of so many times the data's pixels is taken as it is: a crop of a quarter each way.
const DISPLAY_PER_DATA: u128 = 16;

/// A display window that takes so little memory is taken as it is, however little data there is for it.
const MODEST_DISPLAY_BYTES: u128 = 64 << 20;

/// The parts of a file that are read, unpacked.
struct Unpacked {
    headers: Vec<Header>,
    parts: Vec<usize>,
    planes: BTreeMap<usize, Planes>,
}

pub(super) fn decode(source: &Source) -> Result<Picture, LoadError> {
    let Unpacked { headers, parts, planes } = unpack(source, true)?;
    assemble(source, &headers, &parts, planes)
}

/// The data window alone.
pub(super) fn decode_part(source: &Source) -> Result<PicturePart, LoadError> {
    let Unpacked { headers, parts, planes } = unpack(source, false)?;
    let main = &headers[parts[0]];
    let (width, height) = (main.layer_size.0, main.layer_size.1);
    let (display, data) = (main.shared_attributes.display_window, main.own_attributes.layer_position);
    let whole = [display.size.0, display.size.1];
    let offset = |data: i32, display: i32| usize::try_from(i64::from(data) - i64::from(display)).ok();
    let origin = offset(data.0, display.position.0)
        .zip(offset(data.1, display.position.1))
        .filter(|(x, y)| x + width <= whole[0] && y + height <= whole[1]);
    let Some((x, y)) = origin else {
        return Err(source.error("the data window reaches beyond the display window"));
    };
    let picture = window(&headers, &parts, planes, [0, 0], [width, height]);
    Ok(PicturePart { picture, origin: [x, y], whole })
}

/// Checks the file and unpacks it; `show` says whether memory for the display window is going to be needed.
fn unpack(source: &Source, show: bool) -> Result<Unpacked, LoadError> {
    // The decoder turns the end of the file into these words.
    const END_OF_FILE: &str = "reference to missing bytes";
    let damaged = |e: exr::error::Error| match &e {
        exr::error::Error::Io(io) if io.kind() == std::io::ErrorKind::UnexpectedEof => source.cut_short(),
        exr::error::Error::Invalid(text) if text == END_OF_FILE => source.cut_short(),
        _ => source.error(e.to_string()),
    };
    let reader = exr::block::read(Cursor::new(source.bytes), false).map_err(damaged)?;
    let meta = reader.meta_data().clone();
    let parts = choose_parts(&meta.headers);
    check(source, &meta.headers, &parts, show)?;

    let mut planes: BTreeMap<usize, Planes> =
        parts.iter().map(|&part| (part, new_planes(&meta.headers[part]))).collect();
    // Offset tables are as long as the header says, or reading them fails: what follows is bounded by the file.
    let mut chunks = reader
        .filter_chunks(false, |_, tile, block| {
            parts.contains(&block.layer) && tile.is_largest_resolution_level()
        })
        .map_err(damaged)?;
    let mut seen = HashSet::new();
    let mut packed_bytes = 0;
    loop {
        let batch: Vec<Chunk> = chunks.by_ref().take(BATCH).collect::<Result<_, _>>().map_err(damaged)?;
        if batch.is_empty() {
            break;
        }
        // A table that points at one chunk again and again would make a small file endless.
        packed_bytes += batch.iter().map(packed_len).sum::<usize>();
        if packed_bytes > source.bytes.len() {
            return Err(source.error("blocks of pixels overlap in the file"));
        }
        for block in decompress(batch, &meta) {
            let block = block
                .unwrap_or_else(|message| Err(source.panicked(&message).found))
                .map_err(|e| source.error(e))?;
            let index = block.index;
            let fresh = seen.insert((index.layer, index.pixel_position.0, index.pixel_position.1));
            let part =
                planes.get_mut(&index.layer).filter(|_| fresh && (index.level.0, index.level.1) == (0, 0));
            let Some(part) = part else {
                return Err(source.error("a block of pixels stands where another one belongs"));
            };
            part.insert(&block).map_err(|e| source.error(e))?;
        }
    }
    Ok(Unpacked { headers: meta.headers.to_vec(), parts, planes })
}

fn new_planes(header: &Header) -> Planes {
    Planes::new(header.layer_size.0, header.layer_size.1, &header.channels)
}

fn packed_len(chunk: &Chunk) -> usize {
    match &chunk.compressed_block {
        CompressedBlock::Tile(tile) => tile.compressed_pixels_le.len(),
        CompressedBlock::ScanLine(lines) => lines.compressed_pixels_le.len(),
        // Deep data was refused with the header.
        CompressedBlock::DeepScanLine(_) | CompressedBlock::DeepTile(_) => 0,
    }
}

/// The outer result is a panic's message, the inner one the decoder's.
type Decompressed = Result<Result<UncompressedBlock, String>, String>;

fn decompress(batch: Vec<Chunk>, meta: &MetaData) -> Vec<Decompressed> {
    let one = |chunk| {
        // Here, and not only around the whole: these are other threads, and their panics would be printed.
        quietly(|| UncompressedBlock::decompress_chunk(chunk, meta, false).map_err(|e| e.to_string()))
    };
    batch.into_par_iter().map(one).collect()
}

/// The parts to read: the first with colour (or else the first), then those of the same window without subsampling.
fn choose_parts(headers: &[Header]) -> Vec<usize> {
    let main = headers.iter().position(has_color).unwrap_or(0);
    let fits = |header: &Header| {
        header.layer_size == headers[main].layer_size
            && header.own_attributes.layer_position == headers[main].own_attributes.layer_position
            && !is_subsampled(header)
    };
    let others = (0..headers.len()).filter(|&i| i != main && fits(&headers[i]));
    std::iter::once(main).chain(others).collect()
}

fn has_color(header: &Header) -> bool {
    header.channels.list.iter().any(|c| {
        let name = utf8(&c.name);
        matches!(name.rsplit('.').next().unwrap_or_default().to_ascii_uppercase().as_str(), "R" | "Y")
    })
}

fn is_subsampled(header: &Header) -> bool {
    header.channels.list.iter().any(|c| (c.sampling.0, c.sampling.1) != (1, 1))
}

/// Everything that can be refused by the header alone.
fn check(source: &Source, headers: &[Header], parts: &[usize], show: bool) -> Result<(), LoadError> {
    let main = &headers[parts[0]];
    if is_subsampled(main) {
        let error = source.error("its chroma channels are subsampled, which is not supported");
        return Err(error.hint("save it with full RGB channels"));
    }
    let data = [main.layer_size.0 as u64, main.layer_size.1 as u64];
    let display = main.shared_attributes.display_window.size;
    let bytes: u64 = parts.iter().map(|&part| headers[part].channels.bytes_per_pixel as u64).sum();
    source.check_size(data, bytes, DEFLATE_RATIO)?;
    // A render of a small crop has a large display window and little data.
    let pixels = |[width, height]: [u64; 2]| u128::from(width) * u128::from(height);
    let display = [display.0 as u64, display.1 as u64];
    let channels: usize = parts.iter().map(|&part| headers[part].channels.list.len()).sum();
    let modest = pixels(display) * 4 * channels as u128 <= MODEST_DISPLAY_BYTES;
    if show && pixels(display) > pixels(data) * DISPLAY_PER_DATA && !modest {
        source.check_size(display, bytes, DEFLATE_RATIO)?;
    }
    // A tile is decompressed whole, even where it hangs over the edge of the picture.
    for &part in parts {
        let block = headers[part].max_block_pixel_size();
        let bytes = headers[part].channels.bytes_per_pixel as u64;
        if headers[part].blocks.has_tiles() {
            source.check_size([block.0 as u64, block.1 as u64], bytes, DEFLATE_RATIO)?;
        }
    }
    Ok(())
}

fn assemble(
    source: &Source,
    headers: &[Header],
    parts: &[usize],
    planes: BTreeMap<usize, Planes>,
) -> Result<Picture, LoadError> {
    let main = &headers[parts[0]];
    let display = main.shared_attributes.display_window;
    let data = main.own_attributes.layer_position;
    let offset = [
        i64::from(display.position.0) - i64::from(data.0),
        i64::from(display.position.1) - i64::from(data.1),
    ];
    let (width, height) = (display.size.0, display.size.1);
    let visible = |axis: usize, window: usize, size: usize| {
        offset[axis] < size as i64 && offset[axis] + window as i64 > 0
    };
    if !visible(0, width, main.layer_size.0) || !visible(1, height, main.layer_size.1) {
        return Err(source.error("the data window lies outside the display window: there is nothing to see"));
    }

    Ok(window(headers, parts, planes, offset, [width, height]))
}

/// The channels of all parts in a window whose first pixel is at `offset` from theirs.
fn window(
    headers: &[Header],
    parts: &[usize],
    mut planes: BTreeMap<usize, Planes>,
    offset: [i64; 2],
    [width, height]: [usize; 2],
) -> Picture {
    let mut picture = Picture::new(width, height);
    for &part in parts {
        let header = &headers[part];
        let Some(part_planes) = planes.remove(&part) else { continue };
        let names: Vec<String> = header.channels.list.iter().map(|c| utf8(&c.name)).collect();
        let layer = header.own_attributes.layer_name.as_ref().map(utf8).unwrap_or_default();
        for (name, values) in names.into_iter().zip(part_planes.into_window(offset, width, height)) {
            let prefixed = part != parts[0] && !layer.is_empty() && !name.starts_with(&format!("{layer}."));
            let name = if prefixed { format!("{layer}.{name}") } else { name };
            if picture.channel(&name).is_none() {
                picture.channels.push(Channel { name, values });
            }
        }
    }
    picture.metadata = metadata(&headers[parts[0]]);
    picture
}

/// Text and number attributes, those of ours under their own keys.
fn metadata(header: &Header) -> BTreeMap<String, String> {
    let own = &header.own_attributes;
    let known = [
        ("owner", &own.owner),
        ("comments", &own.comments),
        ("software", &own.software_name),
        ("capDate", &own.capture_date),
    ];
    let known = known.into_iter().filter_map(|(key, value)| Some((key.to_owned(), utf8(value.as_ref()?))));
    let others = own.other.iter().chain(&header.shared_attributes.other).filter_map(|(key, value)| {
        let value = match value {
            AttributeValue::Text(text) => utf8(text),
            AttributeValue::F32(number) => number.to_string(),
            AttributeValue::F64(number) => number.to_string(),
            AttributeValue::I32(number) => number.to_string(),
            _ => return None,
        };
        let key = utf8(key);
        Some((key.strip_prefix(PREFIX).map(str::to_owned).unwrap_or(key), value))
    });
    known.chain(others).collect()
}

/// The format says nothing of encodings: UTF-8 where that is possible, else Latin-1.
fn utf8(text: &Text) -> String {
    match std::str::from_utf8(text.as_slice()) {
        Ok(text) => text.to_owned(),
        Err(_) => text.to_string(),
    }
}
