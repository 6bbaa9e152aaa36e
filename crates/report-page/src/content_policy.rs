//! What a page may load and run: nothing but the style sheet and the scripts whose hashes it names.
//!
//! A hash is that of the text between the tags, byte by byte (Content Security Policy Level 3, 6.7.2.3).

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};

/// The one style sheet.
pub(crate) const STYLE: &str =
    concat!(include_str!("../vendor/uplot/uPlot.min.css"), "\n", include_str!("../assets/report.css"));
/// The scripts in the order in which they run.
pub(crate) const SCRIPTS: [&str; 3] = [
    include_str!("../vendor/uplot/uPlot.iife.min.js"),
    include_str!("../assets/path.js"),
    include_str!("../assets/report.js"),
];

/// The source expression of a text.
pub(crate) fn hash(text: &str) -> String {
    format!("'sha256-{}'", STANDARD.encode(Sha256::digest(text)))
}

/// The whole policy.
pub(crate) fn policy() -> String {
    let scripts: Vec<String> = SCRIPTS.iter().map(|script| hash(script)).collect();
    format!(
        "default-src 'none'; style-src {}; script-src {}; img-src data:; base-uri 'none'; form-action 'none'",
        hash(STYLE),
        scripts.join(" ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hash_is_that_of_a_known_text() {
        // SHA-256 of the empty text (FIPS 180-4 examples), in base 64.
        assert_eq!(hash(""), "'sha256-47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU='");
        assert_ne!(hash(" "), hash(""));
    }

    /// An element would end too soon, and with a carriage return the browser would hash another text.
    #[test]
    fn embedded_texts_do_not_end_their_element_and_have_plain_line_ends() {
        for text in SCRIPTS.iter().chain([&STYLE]) {
            let lower = text.to_lowercase();
            assert!(!lower.contains("</script") && !lower.contains("</style") && !lower.contains("<!--"));
            assert!(!text.contains('\r'));
        }
        assert!(!STYLE.contains("url(") && !STYLE.contains("@import"));
    }

    /// What stands in the folder of the vendor is what its README says it is.
    #[test]
    fn vendored_files_have_the_hashes_that_their_readme_states() {
        let readme = include_str!("../vendor/uplot/README.md");
        let files = [
            ("uPlot.iife.min.js", include_str!("../vendor/uplot/uPlot.iife.min.js")),
            ("uPlot.min.css", include_str!("../vendor/uplot/uPlot.min.css")),
            ("LICENSE", include_str!("../vendor/uplot/LICENSE")),
        ];
        for (name, text) in files {
            let digest: String = Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect();
            assert!(readme.contains(&format!("| {name} | {digest} |")), "{name}: {digest}");
        }
    }
}
