//! stub
pub fn gtx(header: [f64; 4], [rows, columns]: [i32; 2], node: impl Fn(usize) -> f32) -> Vec<u8> {
    let mut bytes: Vec<u8> = header.iter().flat_map(|number| number.to_be_bytes()).collect();
    bytes.extend([rows, columns].iter().flat_map(|count| count.to_be_bytes()));
    bytes.extend((0..(rows * columns) as usize).flat_map(|at| node(at).to_be_bytes()));
    bytes
}
