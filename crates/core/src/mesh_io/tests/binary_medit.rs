//! Tests of binary MEDIT: versions, byte orders, the chain of keywords.

use super::samples::{Order, POINTS, TETS, assert_is_sample, read, refusal};

/// Bytes of numbers of one version in one order.
#[derive(Clone, Copy)]
struct Writer {
    version: i32,
    order: Order,
}

impl Writer {
    fn integer(self, value: i64) -> Vec<u8> {
        match self.version {
            4 => self.order.u64(value as u64).to_vec(),
            _ => self.order.i32(value as i32).to_vec(),
        }
    }

    fn real(self, value: f64) -> Vec<u8> {
        match self.version {
            1 => self.order.i32((value as f32).to_bits() as i32).to_vec(),
            _ => self.order.f64(value).to_vec(),
        }
    }

    /// Adds a keyword whose data ends where the next one begins.
    fn keyword(self, out: &mut Vec<u8>, number: i32, data: &[u8]) {
        out.extend(self.order.i32(number));
        let size = if self.version < 3 { 4 } else { 8 };
        let next = out.len() + size + data.len();
        match size {
            4 => out.extend(self.order.i32(next as i32)),
            _ => out.extend(self.order.u64(next as u64)),
        }
        out.extend(data);
    }
}

/// The sample; references 7 and -1 where `has_regions`.
pub(super) fn meshb(version: i32, order: Order, has_regions: bool) -> Vec<u8> {
    let writer = Writer { version, order };
    let mut out = order.i32(1).to_vec();
    out.extend(order.i32(version));
    writer.keyword(&mut out, 3, &order.i32(3));
    // A keyword that is not known, of three bytes.
    writer.keyword(&mut out, 220, b"abc");
    let mut vertices = writer.integer(5);
    for point in POINTS {
        point.iter().for_each(|&c| vertices.extend(writer.real(c)));
        vertices.extend(writer.integer(0));
    }
    writer.keyword(&mut out, 4, &vertices);
    let triangle = [1, 1, 2, 3, 0].map(|value| writer.integer(value)).concat();
    writer.keyword(&mut out, 6, &triangle);
    let mut tets = writer.integer(2);
    for (i, tet) in TETS.iter().enumerate() {
        tet.iter().for_each(|&node| tets.extend(writer.integer(node as i64 + 1)));
        tets.extend(writer.integer(if has_regions { [7, -1][i] } else { 7 }));
    }
    writer.keyword(&mut out, 8, &tets);
    out.extend(order.i32(54));
    out.extend([0; 8].get(..if version < 3 { 4 } else { 8 }).unwrap());
    out
}

#[test]
fn every_version_in_both_byte_orders_gives_the_sample() {
    for version in 1..=4 {
        for order in [Order::Little, Order::Big] {
            let file = read(meshb(version, order, true)).unwrap();
            let label = format!("version {version}, {order:?}");
            assert_is_sample(&file, &label);
            assert_eq!(file.findings.region_labels, ["7", "-1"], "{label}");
            assert_eq!(file.findings.other_cells["triangles"], 1, "{label}");
            assert_eq!(file.findings.skipped_sections, ["keyword 220"], "{label}");
        }
    }
}

#[test]
fn a_chain_of_keywords_that_goes_back_or_out_is_refused() {
    let whole = meshb(2, Order::Little, false);
    for (place, known) in [(4_u32, "expected 16 to"), (1 << 30, "found 1073741824")] {
        let mut bytes = whole.clone();
        bytes[12..16].copy_from_slice(&place.to_le_bytes());
        let error = refusal(bytes);
        assert!(error.starts_with("f: byte 16: the place of the next keyword: "), "{error}");
        assert!(error.contains(known), "{error}");
    }
    let mut plane = whole.clone();
    plane[16] = 2;
    assert_eq!(refusal(plane), "f: no tetrahedra: a mesh of dimension 2");
    let vertices = whole.windows(4).position(|w| w == [5, 0, 0, 0]).unwrap();
    let mut many = whole;
    many[vertices + 3] = 0x7f;
    assert!(refusal(many).contains("Vertices: expected 2130706437, found 140 bytes to the next"));
}
