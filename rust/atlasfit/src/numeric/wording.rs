//! Counts as people write them.
//!
//! In: a count, and the noun of what is counted. Out: text for errors, warnings and reports.

/// A count with thousands parted.
///
/// ```
/// assert_eq!(atlasfit::numeric::wording::count(1_234_567), "1,234,567");
/// ```
#[must_use]
pub fn count(n: usize) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(c);
    }
    out
}

/// A count and what is counted; `what` is one of them, and its plural ends in s.
///
/// ```
/// use atlasfit::numeric::wording::counted;
/// assert_eq!([0, 1, 1500].map(|n| counted(n, "loop")), ["0 loops", "1 loop", "1,500 loops"]);
/// ```
#[must_use]
pub fn counted(n: usize, what: &str) -> String {
    format!("{} {what}{}", count(n), if n == 1 { "" } else { "s" })
}
