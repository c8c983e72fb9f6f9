//! Geometries as blobs: a header of GeoPackage (OGC 12-128, 2.1.3), then well-known binary (OGC 06-103).

/// Points, lines, and collections of them, as WKB numbers them; a thousand more for each further coordinate.
const POINT: u32 = 1;
const LINE: u32 = 2;
const COLLECTIONS: [u32; 2] = [4, 5];
/// Bits by which PostGIS marks the same, and a reference system before the coordinates.
const EXTENDED_Z: u32 = 1 << 31;
const EXTENDED_M: u32 = 1 << 30;
const EXTENDED_SYSTEM: u32 = 1 << 29;
/// Numbers of an envelope, by the three bits of its kind.
const ENVELOPES: [usize; 5] = [0, 4, 6, 6, 8];
/// Little-endian, without and with an envelope of two coordinates.
const PLAIN: u8 = 0b0000_0001;
const WITH_ENVELOPE: u8 = 0b0000_0011;

/// A point.
pub(super) fn point(position: [f64; 2], srs_id: i32) -> Vec<u8> {
    let mut blob = header(PLAIN, srs_id);
    begin(&mut blob, POINT);
    put(&mut blob, &position);
    blob
}

/// A straight line, with its envelope.
pub(super) fn line([from, to]: [[f64; 2]; 2], srs_id: i32) -> Vec<u8> {
    let mut blob = header(WITH_ENVELOPE, srs_id);
    for (one, other) in from.into_iter().zip(to) {
        put(&mut blob, &[one.min(other), one.max(other)]);
    }
    begin(&mut blob, LINE);
    blob.extend(2_u32.to_le_bytes());
    put(&mut blob, &from);
    put(&mut blob, &to);
    blob
}

fn header(flags: u8, srs_id: i32) -> Vec<u8> {
    let mut blob = vec![b'G', b'P', 0, flags];
    blob.extend(srs_id.to_le_bytes());
    blob
}

fn begin(blob: &mut Vec<u8>, kind: u32) {
    blob.push(1);
    blob.extend(kind.to_le_bytes());
}

fn put(blob: &mut Vec<u8>, numbers: &[f64]) {
    for number in numbers {
        blob.extend(number.to_le_bytes());
    }
}

/// The positions of a point or a line, or of the single one in a collection, without their heights.
///
/// # Errors
/// What it is instead.
pub(super) fn positions(blob: &[u8]) -> Result<Vec<[f64; 2]>, String> {
    let cut_off = || "is no geometry of a GeoPackage".to_owned();
    let (head, rest) = blob.split_at_checked(8).ok_or_else(cut_off)?;
    let kind = usize::from(head[3] >> 1 & 0b111);
    let envelope = ENVELOPES.get(kind).filter(|_| head.starts_with(b"GP"));
    let envelope_bytes = envelope.ok_or_else(cut_off)? * size_of::<f64>();
    let (_, wkb) = rest.split_at_checked(envelope_bytes).ok_or_else(cut_off)?;
    let mut reader = Reader {
        rest: wkb,
        is_little: true,
    };
    reader.positions()?.ok_or_else(cut_off)
}

struct Reader<'b> {
    rest: &'b [u8],
    is_little: bool,
}

impl Reader<'_> {
    /// `None` where the bytes end too early.
    fn positions(&mut self) -> Result<Option<Vec<[f64; 2]>>, String> {
        let Some((mut kind, mut coordinates)) = self.kind() else {
            return Ok(None);
        };
        if COLLECTIONS.contains(&kind) {
            match self.count() {
                Some(1) => {}
                Some(count) => return Err(format!("has {count} parts, not one")),
                None => return Ok(None),
            }
            let Some(part) = self.kind() else {
                return Ok(None);
            };
            (kind, coordinates) = part;
        }
        let count = match kind {
            POINT => Some(1),
            LINE => self.count(),
            _ => return Err("is neither a point nor a line".to_owned()),
        };
        Ok(count.and_then(|count| (0..count).map(|_| self.position(coordinates)).collect()))
    }

    /// The kind of a geometry, and how many numbers its positions have.
    fn kind(&mut self) -> Option<(u32, u32)> {
        let (order, rest) = self.rest.split_first()?;
        (self.rest, self.is_little) = (rest, *order == 1);
        let stated = self.count()?;
        if stated & EXTENDED_SYSTEM != 0 {
            self.count()?;
        }
        let marks = [EXTENDED_Z, EXTENDED_M].map(|mark| u32::from(stated & mark != 0));
        let bare = stated & !(EXTENDED_Z | EXTENDED_M | EXTENDED_SYSTEM);
        let more = match bare / 1_000 {
            0 => marks[0] + marks[1],
            1 | 2 => 1,
            _ => 2,
        };
        Some((bare % 1_000, 2 + more))
    }

    fn count(&mut self) -> Option<u32> {
        let (bytes, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(match self.is_little {
            true => u32::from_le_bytes(*bytes),
            false => u32::from_be_bytes(*bytes),
        })
    }

    fn position(&mut self, coordinates: u32) -> Option<[f64; 2]> {
        let position = [self.number()?, self.number()?];
        for _ in 2..coordinates {
            self.number()?;
        }
        Some(position)
    }

    fn number(&mut self) -> Option<f64> {
        let (bytes, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(match self.is_little {
            true => f64::from_le_bytes(*bytes),
            false => f64::from_be_bytes(*bytes),
        })
    }
}
