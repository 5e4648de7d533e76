//! The sample mesh as VTU in every encoding, built byte by byte.

use std::io::Write;

use super::samples::{Order, POINTS, Sample, TETS};
use crate::mesh_io::{Format, encoding};

/// How the binary arrays of a VTU file are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    Plain,
    Zlib,
    Lz4,
}

/// Encoding of a whole VTU file.
#[derive(Clone, Copy, Debug)]
struct Encoding {
    order: Order,
    /// 4 or 8.
    header_bytes: usize,
    packing: Packing,
    appended: bool,
    raw: bool,
}

impl Encoding {
    fn length(self, length: usize) -> Vec<u8> {
        match self.header_bytes {
            4 => self.order.i32(length as i32).to_vec(),
            _ => self.order.u64(length as u64).to_vec(),
        }
    }

    /// Lengths in front, and the data after them; compressed in blocks of 16 bytes.
    fn pack(self, data: &[u8]) -> (Vec<u8>, Vec<u8>) {
        if self.packing == Packing::Plain {
            return (self.length(data.len()), data.to_vec());
        }
        let blocks: Vec<Vec<u8>> = data.chunks(16).map(|block| self.compress(block)).collect();
        let mut header = self.length(blocks.len());
        header.extend(self.length(16));
        // VTK writes 0 here when the last block is a full one.
        header.extend(self.length(data.len() % 16));
        blocks.iter().for_each(|block| header.extend(self.length(block.len())));
        (header, blocks.concat())
    }

    fn compress(self, block: &[u8]) -> Vec<u8> {
        if self.packing == Packing::Lz4 {
            return lz4_flex::block::compress(block);
        }
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(block).unwrap();
        encoder.finish().unwrap()
    }

    /// Text or bytes of one array.
    fn encode(self, data: &[u8]) -> Vec<u8> {
        let (header, data) = self.pack(data);
        match (self.raw, self.packing) {
            (true, _) => [header, data].concat(),
            // VTK encodes lengths and plain data together, lengths and blocks apart.
            (false, Packing::Plain) => encoding::encode(&[header, data].concat()),
            (false, _) => [encoding::encode(&header), encoding::encode(&data)].concat(),
        }
    }

    fn document(self) -> Vec<u8> {
        let order = if self.order == Order::Little { "LittleEndian" } else { "BigEndian" };
        let header = if self.header_bytes == 4 { "UInt32" } else { "UInt64" };
        let compressor = match self.packing {
            Packing::Plain => "",
            Packing::Zlib => " compressor=\"vtkZLibDataCompressor\"",
            Packing::Lz4 => " compressor=\"vtkLZ4DataCompressor\"",
        };
        let connectivity = TETS.as_flattened().iter().flat_map(|&node| self.order.u64(node as u64));
        let arrays = [
            (
                "Points",
                "Float64",
                POINTS.as_flattened().iter().flat_map(|&c| self.order.f64(c)).collect(),
            ),
            ("connectivity", "Int64", connectivity.collect()),
            ("offsets", "Int32", [4, 8].iter().flat_map(|&end| self.order.i32(end)).collect()),
            ("types", "UInt8", vec![10_u8, 10]),
        ];
        let mut appended = Vec::new();
        let mut out = format!(
            "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"{order}\" \
             header_type=\"{header}\"{compressor}>\n<UnstructuredGrid>\n\
             <Piece NumberOfPoints=\"5\" NumberOfCells=\"2\">\n<Points>\n"
        )
        .into_bytes();
        for (name, number, data) in arrays {
            let encoded: Vec<u8> = self.encode(&data);
            write!(out, "<DataArray type=\"{number}\" Name=\"{name}\" ").unwrap();
            if self.appended {
                writeln!(out, "format=\"appended\" offset=\"{}\"/>", appended.len()).unwrap();
                appended.extend(encoded);
            } else {
                out.extend(b"format=\"binary\">\n");
                out.extend(encoded);
                out.extend(b"\n</DataArray>\n");
            }
            if name == "Points" {
                out.extend(b"</Points>\n<Cells>\n");
            }
        }
        out.extend(b"</Cells>\n</Piece>\n</UnstructuredGrid>\n");
        if self.appended {
            let encoding = if self.raw { "raw" } else { "base64" };
            write!(out, "<AppendedData encoding=\"{encoding}\">\n_").unwrap();
            out.extend(appended);
            out.extend(b"\n</AppendedData>\n");
        }
        out.extend(b"</VTKFile>\n");
        out
    }
}

/// VTU text, with the arrays given.
pub(super) fn vtu_text(points: &str, connectivity: &str, offsets: &str, types: &str) -> String {
    format!(
        "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"BigEndian\">\n\
         <UnstructuredGrid>\n<Piece NumberOfPoints=\"5      \" NumberOfCells=\"2   \">\n\
         <PointData></PointData>\n<CellData/>\n\
         <Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">{points}\
         <InformationKey name=\"L2\"><Value index=\"0\">0</Value>\
         </InformationKey></DataArray></Points>\n\
         <Cells>\n<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">\
         {connectivity}</DataArray>\n\
         <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">{offsets}</DataArray>\n\
         <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">\n{types}\n</DataArray>\n\
         </Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"
    )
}

/// The sample mesh as VTU in every encoding.
pub(super) fn vtu_samples() -> Vec<Sample> {
    let mut samples = vec![Sample::new(
        "VTU text",
        Format::Vtu,
        vtu_text(&super::samples::point_lines(None), "0 1 2 3 4 2 1 3", "4 8", "10 10"),
    )];
    for packing in [Packing::Plain, Packing::Zlib, Packing::Lz4] {
        for (appended, raw, label) in [
            (false, false, "VTU inline"),
            (true, false, "VTU appended base64"),
            (true, true, "VTU raw"),
        ] {
            for (order, header_bytes) in [(Order::Little, 8), (Order::Little, 4), (Order::Big, 8)] {
                let encoding = Encoding { order, header_bytes, packing, appended, raw };
                samples.push(Sample::new(label, Format::Vtu, encoding.document()));
            }
        }
    }
    samples
}
