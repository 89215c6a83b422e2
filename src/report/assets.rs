//! What the page brings along: its style, its script, and the policy that lets a browser run nothing else.

use serde::Serialize;
use sha2::{Digest, Sha256};

#[derive(Debug, Serialize)]
pub struct Assets {
    style: &'static str,
    script: &'static str,
    /// The hash by which the page's policy knows its own script. No other runs, and nothing is requested from anywhere: even
    /// markup that slipped in with a name could not do anything.
    script_hash: String,
}

impl Assets {
    pub fn load() -> Assets {
        let script = include_str!("report.js");
        let script_hash = format!("sha256-{}", base64(&Sha256::digest(script)));
        Assets { style: include_str!("report.css"), script, script_hash }
    }
}

/// RFC 4648, with padding.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for group in bytes.chunks(3) {
        let bits = group.iter().chain(&[0, 0]).take(3).fold(0, |bits, &byte| (bits << 8) | usize::from(byte));
        for place in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * place)) & 63];
            text.push(if place <= group.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The examples of RFC 4648, section 10.
    #[test]
    fn base64_is_the_standards() {
        for (text, expected) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(text.as_bytes()), expected);
        }
    }

    #[test]
    fn the_assets_cannot_end_their_own_element() {
        let Assets { style, script, .. } = Assets::load();
        assert!(!style.contains("</") && !script.contains("</"));
    }
}
