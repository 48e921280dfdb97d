//! Numbers for people and for JSON.

use atlasfit::Stage;
pub use atlasfit::numeric::wording::{count, counted};
use serde_json::Value;

/// Four significant digits, without an exponent where the number is easily read.
pub fn short(x: f64) -> String {
    let size = x.abs();
    if size == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    if !(1e-3..1e6).contains(&size) {
        return format!("{x:.3e}");
    }
    let digits = (3 - size.log10().floor() as i32).max(0) as usize;
    format!("{x:.digits$}")
}

/// The word for so many vertices.
pub fn vertex(n: usize) -> &'static str {
    if n == 1 { "vertex" } else { "vertices" }
}

/// A count of vertices.
pub fn vertices(n: usize) -> String {
    format!("{} {}", count(n), vertex(n))
}

/// Edges of a boundary, and the loops that they make.
pub fn boundary(edges: usize, loops: usize) -> String {
    format!("{} in {}", counted(edges, "edge"), counted(loops, "loop"))
}

/// Seconds of all the work, and of each stage that took any.
pub fn seconds(all: f64, stages: &[(Stage, f64)]) -> String {
    let some = stages.iter().filter(|s| s.1 >= 0.005);
    let some: Vec<String> = some.map(|(stage, s)| format!("{} {s:.2}", stage.name())).collect();
    format!("{all:.2} ({})", some.join(", "))
}

/// The seconds of each stage as JSON.
pub fn stages_json(stages: &[(Stage, f64)]) -> Value {
    stages.iter().map(|(stage, s)| (stage.name().to_owned(), json(*s))).collect()
}

/// A JSON number; null where JSON has none (infinity).
pub fn json(x: f64) -> Value {
    serde_json::Number::from_f64(x).map_or(Value::Null, Value::Number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        assert_eq!(
            [1.0, 12.3456, 123456.0, 0.00123456, 1.5e-7].map(short).join(" "),
            "1.000 12.35 123456 0.001235 1.500e-7"
        );
        assert!(json(f64::INFINITY).is_null());
    }
}
